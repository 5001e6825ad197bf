#include "slave/modes.h"

#include <cmath>
#include <numbers>

#include "machine/reason_text.h"

namespace knuckle::slave {
namespace {

Reason first_of(const Reason& a, const Reason& b) noexcept {
  return a ? a : b;
}

Reason not_aligned(const ModeInputs& in, const ModeLimits& limits) noexcept {
  return beyond(ReasonCode::kHandNotAligned, in.hand_rad - in.machine_rad, limits.alignment_rad,
                180 / std::numbers::pi);
}

/// Faults of the machine side once its self test has passed.
Reason machine_side(const ModeInputs& in) noexcept {
  if (in.machine_fault) return in.machine_fault;
  if (!in.nodes_operational) return {ReasonCode::kNodeSetup};
  if (in.stop) return {ReasonCode::kOperatorStop};
  return in.sensor_fault;
}

/// What keeps an operator from taking over at all.
Reason operator_side(const ModeInputs& in) noexcept {
  if (in.link_lost) return in.link_lost;
  if (in.late) return in.late;
  if (in.device) return in.device;
  if (!in.presence) return {ReasonCode::kNoPresence};
  return {};
}

/// What keeps a machine under an enabled operator from being engaged.
Reason alignment(const ModeInputs& in, const ModeLimits& limits) noexcept {
  if (in.hold) return in.hold;
  if (!in.pilot_on) return {ReasonCode::kPilotAwaited};
  if (in.clutch) return {ReasonCode::kClutchHeld};
  const Reason where = not_aligned(in, limits);
  if (where) return where;
  return first_of(beyond(ReasonCode::kHandMoving, in.hand_radps, limits.hand_radps),
                  beyond(ReasonCode::kMachineMoving, in.machine_radps, limits.machine_radps));
}

/// Enable as last heard over a dead link, or let go of by nobody who is there, tells nothing of the next press.
bool released(const ModeInputs& in) noexcept {
  return !in.enable && !operator_side(in);
}

ModeDecision to_ready(const ModeInputs& in, const Reason& why) noexcept {
  return {{Mode::kReady, {}, released(in)}, why};
}

ModeDecision self_test(const ModeInputs& in) noexcept {
  if (in.machine_fault) return fault(in.machine_fault);
  if (!in.nodes_operational) return {{Mode::kSelfTest, {}, false}, {ReasonCode::kStartingUp}};
  if (in.sensor_fault) return {{Mode::kSelfTest, {}, false}, in.sensor_fault};
  return to_ready(in, {in.enable ? ReasonCode::kEnableHeld : ReasonCode::kEnableNotPressed});
}

/// The pilot is asked for from now on, and is what is missing if nothing else is.
ModeDecision to_aligning(const ModeInputs& in, const ModeLimits& limits) noexcept {
  return {{Mode::kAligning, {}, false}, first_of(alignment(in, limits), {ReasonCode::kPilotAwaited})};
}

ModeDecision ready(const ModeState& state, const ModeInputs& in, const ModeLimits& limits) noexcept {
  if (const Reason reason = machine_side(in)) return fault(reason);
  // A press counts only if it was made when nothing else was missing; otherwise it has to be made again.
  if (const Reason missing = operator_side(in)) return to_ready(in, missing);
  if (!in.enable) return to_ready(in, {ReasonCode::kEnableNotPressed});
  if (!state.enable_released) return {{Mode::kReady, {}, false}, {ReasonCode::kEnableHeld}};
  return to_aligning(in, limits);
}

ModeDecision aligning(const ModeInputs& in, const ModeLimits& limits) noexcept {
  if (const Reason reason = machine_side(in)) return fault(reason);
  if (const Reason missing = operator_side(in)) return to_ready(in, missing);
  if (!in.enable) return to_ready(in, {ReasonCode::kEnableNotPressed});
  if (const Reason reason = alignment(in, limits)) return {{Mode::kAligning, {}, false}, reason};
  return {{Mode::kEngaged, {}, false}, {}};
}

/// Engaged and hold: the machine is led (or waits while it is).
ModeDecision led(const ModeState& state, const ModeInputs& in, const ModeLimits& limits) noexcept {
  if (const Reason reason = machine_side(in)) return fault(reason);
  if (in.link_lost) return fault(in.link_lost);
  if (in.device) return fault(in.device);
  if (!in.enable) return to_ready(in, {ReasonCode::kEnableNotPressed});
  if (!in.pilot_on) return fault({ReasonCode::kPilotOff});
  if (!in.presence) return fault({ReasonCode::kPresenceLost});
  if (const Reason wait = first_of(in.hold, in.late)) return {{Mode::kHold, {}, false}, wait};
  if (in.clutch) return {{Mode::kHold, {}, false, true}, {ReasonCode::kClutchHeld}};
  // Out of a hold the set-point may be anywhere: only one near the machine may take over again. Where the operator did
  // nothing to end it, the hand must rest as well: a hand that passes by is no wish to go on.
  if (state.mode == Mode::kHold) {
    const Reason wait = state.by_clutch ? not_aligned(in, limits) : alignment(in, limits);
    if (wait) return {{Mode::kHold, {}, false, state.by_clutch}, wait};
  }
  return {{Mode::kEngaged, {}, false}, {}};
}

/// Fault and E-stop: both need the cause gone, then enable released, then pressed; and heard in time, as what came over
/// too long a round trip may be older than the fault.
ModeDecision latched(const ModeState& state, const ModeInputs& in, const ModeLimits& limits) noexcept {
  const Reason cause = in.explains_fault ? in.machine_fault : state.fault;
  // Nodes that are being started anew are no cause of their own, but nothing goes on before they are ready.
  const bool restarting = !in.machine_fault && !in.nodes_operational;
  if (restarting) return {{state.mode, cause, false}, {ReasonCode::kStartingUp}};
  if (const Reason reason = machine_side(in)) return {{state.mode, cause, false}, reason};
  if (const Reason missing = first_of(operator_side(in), in.hold)) return {{state.mode, cause, false}, missing};
  if (!in.enable) return {{state.mode, cause, true}, {ReasonCode::kEnableNotPressed}};
  if (!state.enable_released) return {{state.mode, cause, false}, {ReasonCode::kReleaseToRecover}};
  return to_aligning(in, limits);
}

}  // namespace

bool explains(const Reason& newer, const Reason& seen, const BusDescription& bus) noexcept {
  if (newer.code != ReasonCode::kNodeFault || seen.code != ReasonCode::kSensorStale) return false;
  const NodeDescription* const node = node_of(seen, bus);
  return node != nullptr && node->id == newer.subject;
}

Reason beyond(ReasonCode code, const JointVector& value, double limit, double unit) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    if (!(std::abs(value[i]) <= limit)) return {code, i, std::abs(value[i]) * unit, limit * unit};
  }
  return {};
}

ModeDecision fault(const Reason& reason) noexcept {
  return {{Mode::kFault, reason, false}, reason};
}

ModeDecision next_mode(const ModeState& state, const ModeInputs& in, const ModeLimits& limits) noexcept {
  if (in.e_stop_open) {
    const Reason reason{ReasonCode::kEmergencyStop};
    return {{Mode::kEStop, reason, false}, reason};
  }
  switch (state.mode) {
    case Mode::kOff:
      return {{Mode::kSelfTest, {}, false}, {ReasonCode::kStartingUp}};
    case Mode::kSelfTest:
      return self_test(in);
    case Mode::kReady:
      return ready(state, in, limits);
    case Mode::kAligning:
      return aligning(in, limits);
    case Mode::kEngaged:
    case Mode::kHold:
      return led(state, in, limits);
    case Mode::kFault:
    case Mode::kEStop:
      return latched(state, in, limits);
  }
  // Not a mode at all (damaged memory): the only safe answer.
  return fault({ReasonCode::kCommandInvalid});
}

}  // namespace knuckle::slave
