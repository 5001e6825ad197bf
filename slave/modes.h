// Which mode the machine is in, and what stands in the way of the next one. One pure function: no clock, no memory but
// the state passed through it, every mode written out.
#pragma once

#include "core/joints.h"
#include "core/reason.h"
#include "core/units.h"
#include "machine/bus_description.h"
#include "transport/link_messages.h"

namespace knuckle::slave {

/// Limits of engaging.
struct ModeLimits {
  double alignment_rad = 5 * kDegree;  ///< Hand to machine per joint: the jump on engaging.
  double hand_radps = 0.10;            ///< A hand at rest on the device trembles below this.
  double machine_radps = 0.05;         ///< Machine at rest; 0.1 mm encoder steps make up to 0.02 at the bucket.
};
inline constexpr ModeLimits kModeLimits{};

struct ModeInputs {
  bool e_stop_open = false;        ///< E-stop chain of the machine.
  Reason machine_fault;            ///< Bus, nodes, valves, gate: a fault in every mode.
  bool explains_fault = false;     ///< machine_fault explains() the latched one.
  Reason sensor_fault;             ///< "Not yet" during the self test, a fault after it.
  bool nodes_operational = false;  ///< All of them, configured and supervised.
  bool pilot_on = false;           ///< Pilot pressure is on: needed while the machine is led.
  Reason link_lost;                ///< No newer packet within the limit: a fault while the machine is led.
  Reason hold;                     ///< Asks to wait without a fault.
  Reason late;                     ///< So does a round trip that is too long; nobody takes over by packets that old.
  bool presence = false, enable = false, clutch = false, stop = false;  ///< As the operator's newest packet says.
  Reason device;  ///< Why the haptic device cannot be used: a fault while the machine is led.
  JointVector hand_rad = JointVector::Zero(), hand_radps = JointVector::Zero();  ///< Operator set-point.
  JointVector machine_rad = JointVector::Zero(), machine_radps = JointVector::Zero();
};

struct ModeState {
  Mode mode = Mode::kOff;
  Reason fault;                  ///< The latched fault; kept while in kFault and kEStop.
  bool enable_released = false;  ///< Enable was seen released when nothing else stood in the way of pressing it.
  bool by_clutch = false;        ///< kHold: of the operator's own, who ends it by letting go of the clutch.
};

struct ModeDecision {
  ModeState state;
  Reason blocking;  ///< What keeps the machine from being engaged (kNone when engaged), or what the operator must do.
};

/// Whether the newer reason tells the cause of what was seen before: a node that says that it left its working state,
/// of process data that had not come.
[[nodiscard]] bool explains(const Reason& newer, const Reason& seen, const BusDescription& bus) noexcept;

/// First joint where |value| is not within its limit (a NaN is not), told in this unit; else kNone.
[[nodiscard]] Reason beyond(ReasonCode code, const JointVector& value, double limit, double unit = 1) noexcept;

/// Into kFault, whatever the mode was.
[[nodiscard]] ModeDecision fault(const Reason& reason) noexcept;

/// One step of the mode machine. E-stop first, then faults; both latch until their cause is gone, enable was released
/// and pressed again; then the hand is aligned anew.
[[nodiscard]] ModeDecision next_mode(const ModeState& state, const ModeInputs& in,
                                     const ModeLimits& limits = kModeLimits) noexcept;

}  // namespace knuckle::slave
