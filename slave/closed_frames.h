// Counters and checksums of the frames that the machine sends by itself.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "machine/bus_description.h"
#include "transport/frame_checksum.h"

namespace knuckle::slave {

/// Why a frame's values are none, because it is damaged or an old one. The counter of an identifier runs over all
/// frames that a multiplexer tells apart: one of them that comes again and again among living ones repeats its own
/// count, and not the one before.
class ClosedFrames {
 public:
  explicit ClosedFrames(const BusDescription& bus) {
    for (const BroadcastFrame& frame : bus.broadcasts) {
      if (!frame.closing.counter && !frame.closing.checksum) continue;
      auto known = std::find_if(all_.begin(), all_.end(), [&](const Closed& one) { return one.id == frame.id; });
      if (known == all_.end()) known = all_.insert(all_.end(), {.id = frame.id, .closing = frame.closing});
      if (frame.multiplexer) known->apart.push_back({*frame.multiplexer});
    }
  }

  /// @return kNone, kChecksumWrong or kCounterRepeated
  [[nodiscard]] FrameFault fault(const CanFrame& frame) noexcept {
    const auto closed = std::find_if(all_.begin(), all_.end(), [&](const Closed& one) { return one.id == frame.id; });
    if (closed == all_.end()) return FrameFault::kNone;
    const FrameCheck check = check_frame(closed->closing, closed->count, frame);
    closed->count = check.count;
    if (check.fault == FrameFault::kChecksumWrong || check.fault == FrameFault::kCounterRepeated) return check.fault;
    for (Apart& one : closed->apart) {
      if (read_raw(one.multiplexer.bits, frame) != one.multiplexer.value) continue;
      const bool again = check.fault == FrameFault::kCounterSkipped && one.count == check.count;
      one.count = check.count;
      return again ? FrameFault::kCounterRepeated : FrameFault::kNone;
    }
    return FrameFault::kNone;
  }

 private:
  struct Apart {
    Multiplexer multiplexer;
    std::optional<std::uint64_t> count{};
  };
  struct Closed {
    std::uint32_t id = 0;
    FrameClosing closing;
    std::optional<std::uint64_t> count{};  ///< Of the frame before.
    std::vector<Apart> apart{};
  };
  std::vector<Closed> all_;  // sized once, at construction
};

}  // namespace knuckle::slave
