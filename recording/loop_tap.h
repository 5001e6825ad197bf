// What one loop writes down while it steps, for a recorder in another thread: what crossed its wires, and what it knew
// and did at the end of each step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/byte_ring.h"
#include "core/reason.h"
#include "core/time.h"
#include "master/master_state.h"
#include "recording/cdr.h"
#include "recording/fields.h"
#include "recording/wire_events.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

/// In front of every step on its way to the recorder.
struct StepHeader {
  std::int64_t time_ns = 0;
  std::uint32_t wires_size = 0, state_size = 0;  ///< Of the two messages behind it; 0: it has no such message.
  ReasonCode alarm = ReasonCode::kNone;          ///< Why the machine is stopped in this step.
};

/// For the loop's thread. Off until record_to(): then it costs a branch for each event. Allocates there alone.
class LoopTap {
 public:
  LoopTap() = default;
  LoopTap(const LoopTap&) = delete;
  LoopTap& operator=(const LoopTap&) = delete;

  /// @param ring outlives this.
  void record_to(ByteRing& ring) {
    ring_ = &ring;
    room_.resize(kStepBytes);
  }
  [[nodiscard]] bool on() const noexcept { return ring_ != nullptr; }

  /// Something crossed a wire.
  void add(WireEventKind kind, std::uint32_t value, std::span<const std::uint8_t> data = {}) noexcept;
  /// The step is over. @param state lists its fields (recording/fields.h).
  template <typename State>
  void end_step(Time now, const State& state, ReasonCode alarm) noexcept {
    if (!on()) return;
    const std::size_t wires_size = finish_wires(now);
    CdrWriter out(std::span<std::uint8_t>(room_).subspan(sizeof(StepHeader) + wires_size));
    put(out, state);
    push(now, wires_size, out.size(), alarm);
  }
  /// A step without a state of its own.
  void end_step(Time now, ReasonCode alarm) noexcept {
    if (on()) push(now, finish_wires(now), 0, alarm);
  }

 private:
  static constexpr std::size_t kStateBytes = 4096;
  static constexpr std::size_t kStepBytes = 96 * 1024;  ///< All that a step may read of a flood, and its state.

  void begin_wires() noexcept;
  [[nodiscard]] std::size_t finish_wires(Time now) noexcept;
  void push(Time now, std::size_t wires_size, std::size_t state_size, ReasonCode alarm) noexcept;

  ByteRing* ring_ = nullptr;
  std::vector<std::uint8_t> room_;
  std::optional<CdrWriter> wires_;  // while a step is under way
  std::uint32_t step_ = 0, count_ = 0, lost_ = 0;
};

// The end of a step of the two loops, on their taps.

/// Why the machine is stopped, as far as the loop knows. An operator's side that hears nothing of the machine while it
/// leads it cannot know more.
[[nodiscard]] inline ReasonCode alarm_of(const slave::SlaveState& state) noexcept {
  return state.fault.code;
}
[[nodiscard]] inline ReasonCode alarm_of(const master::MasterState& state) noexcept {
  return state.warning.code == ReasonCode::kCuesSilence ? state.warning.code : state.fault.code;
}

/// After the loop's step at `now`, and whatever else belongs to it. Nothing where the tap is off.
template <typename Loop>
void end_step(LoopTap& tap, Time now, const Loop& loop) noexcept {
  if (!tap.on()) return;
  const auto state = state_of(now, loop);
  tap.end_step(now, state, alarm_of(state));
}

}  // namespace knuckle::recording
