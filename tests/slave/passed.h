// Commands that a gate has let pass: nobody else can make any.
#pragma once

#include "slave/safety_gate.h"

namespace knuckle::slave {

/// @param value at most 0.35
inline PassedCommands passed_now(const MachineDescription& machine, int joint, double value, Time now) {
  JogState state;
  state.joint = joint;
  state.since = state.oldest_at = now;
  JointVector wanted = JointVector::Zero();
  wanted[joint] = value;
  return jog_gate(wanted, state, {wanted, now}, GateLimits(machine), now).commands;
}

}  // namespace knuckle::slave
