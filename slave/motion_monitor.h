// Whether joints move as the machine's own controller was told: where nobody tells where the spools are, their motion
// is all that tells of the valves.
#pragma once

#include <array>
#include <cstddef>

#include "core/joints.h"
#include "core/reason.h"
#include "estimation/joint_state.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::slave {

struct MotionLimits {
  double lag_s = 0.4;        ///< Of the machine's controller, valve and oil.
  double more = 1.3;         ///< Of what was told: its controller's error.
  double leak_radps = 0.02;  ///< Of a load that sinks.
  /// Travel that nobody asked for: oil gives way, a load swings. The nearer to the bucket, the shorter is the tip's
  /// way.
  PerJoint<double> beyond_rad{0.12, 0.15, 0.2};
  double any_speed = 3;       ///< Of a joint's greatest rate: what an open valve may make of it.
  double less = 0.5;          ///< Of what was told all the while.
  double missing_rad = 0.08;  ///< Travel that did not come; twice that of a cylinder whose pressures nobody measures.
  /// Half of what was told while the measured angle does not change in its last bit, beyond leak_radps: also where
  /// something seems to be touched, for a frozen angle makes a force of its own. Its way must have gone over so many
  /// steps of the encoder.
  double unmoved_rad = 0.1;
  double unmoved_steps = 3;
  double held = 0.8;     ///< Share of the main relief in the driven chamber: something holds the joint.
  double pushed = 0.95;  ///< Of the port relief: a load pushes the cylinder against this chamber, whose oil escapes.
};
inline constexpr MotionLimits kMotion{};

/// Two sums per joint and direction, neither below zero: of travel beyond all that was told lately, less a leak; and of
/// travel that was told all the while and did not come; and one per joint, of travel either way that was told while the
/// measured angle stood still in its last bit. The first is of the travel that the valve has let through: a
/// joint that swings on its oil, where pressures tell that, is no valve's doing. Of pilot pressures and currents it is
/// known which way they may move a joint, not how fast: Plausibility looks for the joints that stand.
class MotionMonitor {
 public:
  MotionMonitor(const MachineDescription& machine, double step_s);
  void reset() noexcept;
  /// @param demand as on the wire, [-1, 1] @param pressed something is touched: a joint may stand.
  /// @return kMotionNotFollowing, with degrees beyond, or missing, and their limit.
  [[nodiscard]] Reason step(const JointVector& demand, const estimation::JointState& state, bool pressed) noexcept;

 private:
  static constexpr std::size_t kSlots = 128;  // 0.45 s at up to 280 Hz
  struct Way {
    double beyond_rad = 0, missing_rad = 0;
  };
  /// Half of what was told since the angle last changed: how much, and where to.
  struct Unmoved {
    double sum_rad = 0, at_rad = 0, low_rad = 0, high_rad = 0;
  };
  struct Axis {
    std::array<double, kSlots> told_radps{};
    double last_rad = 0, last_let_in_rad = 0;
    Unmoved unmoved;
    std::array<Way, 2> ways{};  ///< Down, up.
  };
  /// Why a joint may do otherwise: its oil is near a relief.
  struct Held {
    bool driven = false;  ///< The main one, in the chamber that the command drives.
    bool any = false;
    std::array<bool, 2> pushed{};  ///< A port's, so that it may be pushed down, up.
  };
  void note_unmoved(Axis& axis, bool held) const noexcept;
  /// At most, of a command whose effect is not known; its sign is the joint's direction.
  [[nodiscard]] double told_radps(int joint, double demand, double lever_m) const noexcept;
  [[nodiscard]] Reason look(Axis& axis, int joint, double moved_rad, double let_in_rad, bool touched, const Held& held,
                            double missing_limit_rad, double steps_rad) noexcept;

  MachineDescription machine_;
  Kinematics kinematics_;
  double step_s_;
  std::size_t lag_steps_;
  double held_Pa_, pushed_Pa_;
  bool by_rate_;
  JointVector step_m_;  // of the encoders, of their cylinders' length
  // Retracting, extending: speed at the full command, and the command up to which the valve is shut.
  std::array<JointVector, 2> full_radps_{JointVector::Zero(), JointVector::Zero()},
      shut_{JointVector::Zero(), JointVector::Zero()};
  PerJoint<Axis> axes_{};
  std::size_t next_ = 0, seen_ = 0;
};

}  // namespace knuckle::slave
