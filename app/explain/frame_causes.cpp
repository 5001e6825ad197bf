// Causes at frames that the machine sends by itself: one that does not come, is too short, or comes again and again.
#include <fmt/format.h>

#include <algorithm>

#include "app/explain/cause.h"
#include "app/explain/window.h"
#include "core/frame_words.h"
#include "machine/reason_text.h"

namespace knuckle::explain {
namespace {

/// The frame of the signal that the stop's reason names; null where it names none.
const FrameSeen* meant_by(const Stop& stop, const Evidence& evidence, const BusDescription& bus) {
  const auto place = signal_of(stop.reason);
  if (!place || *place >= kSignals.size()) return nullptr;
  const BroadcastFrame* const frame = bus.broadcast(kSignals[*place].role, kSignals[*place].index).frame;
  const auto found = std::find_if(evidence.frames.begin(), evidence.frames.end(),
                                  [frame](const FrameSeen& seen) { return seen.frame == frame; });
  return found == evidence.frames.end() ? nullptr : &*found;
}

bool silent(const FrameSeen& seen) {
  return seen.stream.silent();
}

std::optional<Cause> missing(const FrameSeen& seen, const Evidence& evidence) {
  const bool nodes_too = !evidence.nodes.empty() && std::all_of(evidence.nodes.begin(), evidence.nodes.end(),
                                                                [](const NodeSeen& node) { return node.silent(); });
  if (!silent(seen) || nodes_too) return std::nullopt;
  const Time since = *seen.stream.last, missed = since + seen.stream.usual,
             until = seen.stream.next.value_or(seen.stream.known_until);
  std::size_t others = 0, living = 0;
  for (const FrameSeen& other : evidence.frames) {
    if (&other == &seen || ((other.frame->id ^ seen.frame->id) & kSecondBus) != 0) continue;
    // One that comes seldom need not have been due meanwhile, and says nothing.
    const Stream& of = other.stream;
    const bool came = !silent(other) && ((of.last && *of.last > missed) || (of.next && *of.next < until));
    others += came || silent(other) ? 1U : 0U;
    living += came ? 1U : 0U;
  }
  const std::string usual =
      fmt::format("it came last at {}, usual every {}", at_text(since), span_text(seen.stream.usual));
  if (others > 0 && living == 0)
    return Cause{"frames_missing",
                 "nothing that the machine sends by itself came since " + at_text(since) +
                     ": the bus is cut, or the controller that sends it is off or hangs",
                 {seen.name + ": " + usual},
                 {"a cut cable and a controller that is off look the same from here"},
                 since};
  Cause cause{"frame_missing",
              seen.name + " did not come since " + at_text(since) + ": what sends it is off, or sends it no more",
              {usual},
              {},
              since};
  if (others > 0)
    cause.supports.push_back(fmt::format("{} of the {} other frames of its bus came in time", living, others));
  return cause;
}

}  // namespace

std::optional<Cause> frame_cause(const Stop& stop, const Evidence& evidence, const MachineDescription& machine) {
  const FrameSeen* const seen = meant_by(stop, evidence, machine.bus);
  if (seen == nullptr) return std::nullopt;
  const Reason& reason = stop.reason;
  if (reason.code == ReasonCode::kSensorStale) return missing(*seen, evidence);
  Cause cause{"", reason_text(machine, reason), {}, {}, stop.at};
  if (reason.code == ReasonCode::kFrameShort) {
    cause.id = "frame_short";
  } else if (reason.code == ReasonCode::kSensorInvalid && reason.limit == kCounterStands) {
    cause.id = "frame_repeated";
    cause.since = seen->counted.value_or(stop.at);
    cause.text = seen->name + ": its counter stands since " + at_text(cause.since) +
                 ": what sends it hangs and repeats its last frame, or does not count as the machine file says";
  } else if (reason.code == ReasonCode::kSensorInvalid && reason.limit == kChecksumWrong) {
    cause.id = "frame_damaged";
  } else {
    return std::nullopt;
  }
  if (!silent(*seen)) cause.supports.emplace_back("it goes on coming in time: bus and power of its sender are sound");
  return cause;
}

}  // namespace knuckle::explain
