#include "app/session/wire_latency.h"

#include <cstdint>

#include "core/histogram.h"
#include "transport/canopen.h"

namespace knuckle::session {
namespace {

// From the last frame with this identifier at or before each span's start, to its end.
Histogram since_frame(const FrameLog& frames, std::uint32_t id, const std::vector<Span>& spans) {
  Histogram latency;
  auto next = frames.begin();
  Time last = kNever;
  for (const Span& span : spans) {
    for (; next != frames.end() && next->at <= span.from; ++next) {
      if (next->frame.id == id) last = next->at;
    }
    if (last != kNever) latency.add(span.to - last);
  }
  return latency;
}

// From each span's start to the first frame with this identifier at or after its end.
Histogram until_frame(const FrameLog& frames, std::uint32_t id, const std::vector<Span>& spans) {
  Histogram latency;
  auto frame = frames.begin();
  Time taken = kNever;
  for (const Span& span : spans) {
    while (frame != frames.end() && (frame->at < span.to || frame->frame.id != id)) ++frame;
    if (frame == frames.end()) break;
    if (frame->at != taken) latency.add(frame->at - span.from);
    taken = frame->at;
  }
  return latency;
}

}  // namespace

void add_wire_latencies(const FrameLog& frames, const BusDescription& bus, const WireSpans& spans,
                        HopHistograms& hops) {
  const std::uint32_t set_point_id = bus.valves.back().rpdo_id();
  const std::uint32_t pressure_id = bus.pressures.back().tpdo_id();
  hops.hand_to_valve = until_frame(frames, set_point_id, spans.acted);
  hops.pressure_to_slave = since_frame(frames, pressure_id, spans.measured);
  hops.pressure_to_hand = since_frame(frames, pressure_id, spans.felt);
}

}  // namespace knuckle::session
