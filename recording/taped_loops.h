// The end of a step of the two loops, on their tapes.
#pragma once

#include "core/time.h"
#include "master/master_state.h"
#include "recording/loop_tape.h"
#include "slave/slave_loop.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

/// Why the machine is stopped, as far as the loop knows. An operator's side that hears nothing of the machine while it
/// leads it cannot know more.
[[nodiscard]] inline ReasonCode alarm_of(const slave::SlaveState& state) noexcept {
  return state.fault.code;
}
[[nodiscard]] inline ReasonCode alarm_of(const master::MasterState& state) noexcept {
  return state.warning.code == ReasonCode::kCuesSilence ? state.warning.code : state.fault.code;
}

/// After the loop's step at `now`, and whatever else belongs to it. Nothing where the tape is off.
template <typename Loop>
void end_step(LoopTape& tape, Time now, const Loop& loop) noexcept {
  if (!tape.on()) return;
  const auto state = state_of(now, loop);
  tape.end_step(now, state, alarm_of(state));
}

}  // namespace knuckle::recording
