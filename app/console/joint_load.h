// What the oil of each joint does, by lengths, pressures and the machine's file: whether the joint stands at an end of
// its way, and whether its oil pushes harder than weight and friction explain. One rule for each; banner, picture and
// cards only say it.
#pragma once

#include <cstddef>

#include "core/joints.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "transport/link_messages.h"

namespace knuckle::console {

inline constexpr double kWorthSaying_N = 200;  ///< At the bucket: who presses with less does no harm.

struct JointLoad {
  int end = 0;             ///< +1, -1: at the end of its way where its angle is largest, smallest; 0: at neither.
  int at_steel = 0;        ///< +1, -1: the end whose steel may be here already; 0: it is farther off.
  int pushes = 0;          ///< +1, -1: its oil pushes the angle up, down, beyond what weight and friction explain.
  double beyond_Nm = 0;    ///< By so much at least.
  double reach_m = 1;      ///< To the farthest place that it presses with: there are at least beyond_Nm / reach_m.
  double pressure_Pa = 0;  ///< In the chamber that pushes.
  bool at_relief = false;  ///< That chamber is as full as a relief valve lets it be.
  bool at_rest = false;    ///< Its rod.
  bool steady = false;     ///< It has pushed one way for longer than an arm that starts or stops; said by a PushWatch.
  bool lasts = false;      ///< For longer still, with all rods at rest; said by a PushWatch.

  /// On something that stands in its way.
  [[nodiscard]] bool presses() const noexcept { return pushes != 0 && pushes != at_steel; }
  /// Against its own end: nothing moves when that oil is let out.
  [[nodiscard]] bool pushes_on_its_end() const noexcept { return pushes != 0 && pushes == at_steel; }
};
using JointLoads = PerJoint<JointLoad>;

/// Allows for what the operator's side does not know: how the hull stands (up to 0.1 rad), a load that is not estimated
/// (up to a full bucket), and, where only a drawing says where the steel is, the last 7 mm of a rod's way.
/// @param m with fresh pose and pressures.
[[nodiscard]] JointLoads joint_loads(const SlaveMessage& m, const MachineDescription& machine,
                                     const Kinematics& kinematics);

/// +1, -1: the end of its range that the joint is within the soft margin of, where the hand meets a wall; 0: neither.
/// @param error_rad of a measured angle, by which it may be nearer.
[[nodiscard]] int end_of_range(const MachineDescription& machine, std::size_t joint, double angle_rad,
                               double error_rad = 0) noexcept;
/// Marks the pushes that last. Others are of an arm that touches nothing: one that was stopped at speed swings on its
/// oil and pushes to and fro, and one that starts or turns round is pushed for as long as that takes.
class PushWatch {
 public:
  static constexpr Duration kLasts = 500ms;   ///< Longer than an arm on its oil pushes one way.
  static constexpr Duration kSteady = 250ms;  ///< Longer than one is sped up or slowed down.
  /// For every view. @param loads of it: those are marked that have pushed one way for so long.
  void watch(JointLoads& loads, Time now) noexcept;

 private:
  struct Push {
    int way = 0;
    Time since{};
  };
  PerJoint<Push> pushes_{}, at_rest_{};
  Time seen_ = kNever;
};

/// Whether a chamber is as full as the relief valve lets it be: the joint pushes, and cannot push harder.
[[nodiscard]] bool at_relief(const HydraulicsDescription& hydraulics, double pressure_Pa) noexcept;

}  // namespace knuckle::console
