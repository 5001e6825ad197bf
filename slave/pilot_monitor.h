// Does a spool follow what its machine was told, by the pilot pressures that move it?
#pragma once

#include <array>

#include "core/joints.h"
#include "core/reason.h"
#include "machine/description.h"
#include "slave/valve_monitor.h"

namespace knuckle::slave {

struct PilotLimits {
  /// Of an opening: as of a valve node's spool, and a step of the coarsest that may tell it.
  double tolerance = ValveMonitor::kTolerance + 0.05;
  double patience_s = 0.08;  ///< The window is that of a valve node; a pressure has no spool's way to go.
  // Of a commanded speed, which says no opening:
  double lag_s = 0.4;      ///< Of the machine's controller, as MotionLimits has it.
  double asked = 0.02;     ///< Of full speed: what asks for a direction; less is dither.
  double unasked_s = 0.2;  ///< Open for so long in a direction that nobody has asked for during that lag: fault.
  double fast = 0.5;       ///< Of full speed: no load moves a joint so fast behind a shut valve.
  double shut_s = 0.2;     ///< Shut for so long although so much was asked for during that lag and ever since: fault.
};
inline constexpr PilotLimits kPilotLimits{};

/// Pressures, currents and voltages say how far a spool is to open: ValveMonitor compares. A speed says only which way,
/// for the machine's controller opens as far as the load wants it, and trims; it does not open the other way for long,
/// nor stay shut where half of the speed is wanted.
class PilotMonitor {
 public:
  PilotMonitor(const MachineDescription& machine, double step_s);
  void reset() noexcept;
  /// @param demand as on the wire, @param opening PilotSpool::opening() of the joints that tell it; both [-1, 1].
  /// @return kValveNotFollowing with the joint, and by how much of its opening.
  [[nodiscard]] Reason step(const JointVector& demand, const JointVector& opening) noexcept;

 private:
  struct Way {
    double unasked_s = 0, open_s = 0, fast_s = 0, shut_s = 0;
  };
  [[nodiscard]] Reason look(Way& way, int joint, double demand, double opening) const noexcept;

  PerJoint<ValveDescription> valves_;
  double step_s_;
  bool by_rate_;
  PerJoint<bool> told_{};
  ValveMonitor monitor_;
  PerJoint<std::array<Way, 2>> ways_{};
};

}  // namespace knuckle::slave
