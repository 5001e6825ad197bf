// Sensors against each other: oil that leaves a cylinder must be seen by its encoder, a closed valve keeps its
// cylinder in place, and a living pressure transmitter never repeats itself. Finds sensors that send good-looking
// nonsense.
#pragma once

#include <array>

#include "core/joints.h"
#include "core/reason.h"
#include "estimation/joint_state.h"
#include "machine/arm_description.h"
#include "machine/bus_description.h"
#include "slave/flow_share.h"
#include "slave/pilot_or_position.h"

namespace knuckle::slave {

/// Chosen so that no machine of the allowed spread (transmitters +-1 bar, encoder steps 0.1 mm, oil +-30 %, friction
/// +-30 %, dead band +-1 % of stroke where the valve is identified, else +-3 %) comes near them without a broken
/// sensor.
struct PlausibilityLimits {
  double open_margin = 0.04;  ///< [of stroke] A spool this far beyond its dead band lets oil through ...
  /// A spool that is open in no direction for less than this only passes: what was delivered before still counts. A
  /// cylinder that swings on its oil behind a frozen encoder shuts its valve again and again.
  double passing_s = 0.1;
  double closed_margin = 0.03;  ///< This far inside the dead band it lets none through. Dead bands are known to 1 %.
  double sure_flow = 0.7;       ///< Part of the flow seen before (FlowShare) that comes whatever gain and oil are.
  double sure_drop_Pa = 2e5;  ///< Taken off the return side's drop to tank: transmitter and tank are not known better.
  double moved_m = 0.00035;   ///< An encoder that differs by this has moved ...
  double moved_steps = 3.5;   ///< ... or, a coarse one, by this.
  double unseen_m = 0.004;    ///< Travel delivered without being seen: fault.
  /// The same where frames tell the machine what to do: pilot pressures do not tell of a spool that sticks a little,
  /// and a worn machine comes to 4 mm. And where nobody measures the cylinder's pressures: what is delivered is
  /// reckoned with the pump's margin alone, and a cylinder that cannot move delivers as much. Stock scenarios stay
  /// below 2 mm.
  double unseen_unmeasured_m = 0.01;
  double stall = 0.6;  ///< Of the main relief: a driven chamber above it may be a cylinder that cannot move ...
  /// ... below it, one that does not move behind an open valve for so long, over its FlowShare, is a fault.
  double unmoved_s = 0.8;
  double end_m = 0.010;            ///< This close to its end a cylinder is cushioned or at its stop.
  double settle_s = 0.15;          ///< A spool must have been closed this long; cylinders stop within it.
  double closed_travel_m = 0.015;  ///< Travel behind a closed valve: fault. And what oil gives way, times this,
  double closed_oil = 1.3;         ///< as far as its pressures have changed since; up to the relief 11 mm of 0.41 m.
  double closed_forget_s = 1.0;    ///< Leakage of some mm/s is no travel.
  double relief = 0.9;             ///< Of the port relief: above it a closed cylinder may be pushed.
  int repeats = 20;                ///< Same pressure this often (100 ms): with noise above half a step, 1e-15.
  int repeats_quiet = 100;         ///< Likewise for transmitters without noise.
  double other_side_Pa = 5e5;      ///< What the other chamber must have changed meanwhile: ten times its noise ...
  double repeat_travel_m = 0.005;  ///< ... or the cylinder have moved.
  double cavitating_Pa = 3e5;      ///< Below it a chamber may really stand at one value.
  // Within a step that is coarser than this a chamber may stand for a second while all else moves, near tank always.
  double coarse_Pa = 1e5;
  int repeats_coarse = 1000;  ///< Same pressure this often, whatever the cylinder does ...
  double coarse_steps = 10;   ///< ... while the other chamber changes by so many steps, half of them above vacuum.
  // All pressures at once: noise alone changes one of six within 0.3 s.
  double still_s = 0.5;          ///< None has changed for so long ...
  double still_travel_m = 0.15;  ///< ... while a cylinder moved so far.
};
inline constexpr PlausibilityLimits kPlausibility{};

class Plausibility {
 public:
  /// @param step_s the fixed time between calls.
  Plausibility(const MachineDescription& machine, double step_s);
  /// @param spool SlaveLoop::spool() @param piloting what moved it
  /// @return kSensorImplausible with the node or signal; value and limit in the unit of the rule (m, s or samples).
  /// kMotionNotFollowing where it may be the valve as well, because neither the spool is told nor what moves it. Not
  /// latched.
  [[nodiscard]] Reason step(const estimation::Measurement& measurement, const JointVector& spool,
                            const Piloting& piloting) noexcept;
  void reset() noexcept;

 private:
  struct Axis {
    double anchor_m = 0;                                                 // length when the encoder last moved
    double return_Pa = 0;                                                // the returning chamber's pressure then
    double delivered_m = 0;                                              // travel the valve has let through since
    int direction = 0;                                                   // of the opening
    std::array<FlowShare, 2> share{FlowShare(false), FlowShare(false)};  // extending, retracting; survives reset()
    double stalled_s = 0;  // open, not seen to move, and not driven as a stalled one would be
    double shut_s = 0;     // not open
    double closed_s = 0;
    double travel_m = 0;  // behind the closed valve, forgetting
    double last_m = 0;
    std::array<double, 2> closed_Pa{};  // when the valve was closed
  };
  struct Chamber {
    double value_Pa = 0;
    int repeats = 0;
    double other_min_Pa = 0, other_max_Pa = 0, length_m = 0;  // since it repeats
  };
  [[nodiscard]] double nominal_flow(int joint, double spool, double return_Pa) const noexcept;
  [[nodiscard]] double return_Pa(const estimation::Measurement& m, int joint, int direction) const noexcept;
  [[nodiscard]] double expanded_m(int joint, int direction, double length_m, double fall_Pa) const noexcept;
  [[nodiscard]] Reason frozen(int joint, const estimation::Measurement& m, double spool) noexcept;
  [[nodiscard]] Reason moving_while_closed(int joint, const estimation::Measurement& m, double spool) noexcept;
  [[nodiscard]] Reason stuck(std::size_t chamber, const estimation::Measurement& m) noexcept;
  [[nodiscard]] Reason all_still(const estimation::Measurement& m) noexcept;

  PerJoint<CylinderDescription> cylinders_;
  HydraulicsDescription hydraulics_;
  BusDescription bus_;
  PilotOrPosition wrong_;
  PerJoint<bool> told_{};  // where the spool is, or what moves it
  double step_s_;
  std::array<int, 6> repeats_{};  // of each chamber's pressure
  double step_Pa_;
  JointVector moved_m_;
  PerJoint<Axis> axes_{};
  std::array<Chamber, 6> chambers_{};
  struct Still {
    std::array<double, 6> pressure_Pa{};
    JointVector from_m = JointVector::Zero();
    double time_s = 0;
  };
  Still still_;
};

}  // namespace knuckle::slave
