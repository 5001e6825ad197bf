// The end of a step of the two loops, on their tapes.
#pragma once

#include "core/time.h"
#include "master/master_state.h"
#include "recording/loop_tape.h"
#include "slave/slave_loop.h"
#include "slave/slave_state.h"

namespace knuckle::recording {

/// After the loop's step at `now`, and whatever else belongs to it. Nothing where the tape is off.
template <typename Loop>
void end_step(LoopTape& tape, Time now, const Loop& loop) noexcept {
  if (!tape.on()) return;
  const auto state = state_of(now, loop);
  tape.end_step(now, &state, state.fault.code);
}

}  // namespace knuckle::recording
