// Joint control where the command is a joint's speed, on a joint that swings on its oil.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "machine/load.h"
#include "machine/oil_stiffness.h"
#include "slave/joint_control.h"
#include "tests/slave/standing.h"

namespace knuckle::slave {
namespace {

constexpr double kPeriod_s = 5e-3;

/// One joint of the 20 t machine, a spring between the oil let in and the link: x'' = w^2 (u - x) - 2 z w x'.
struct Swinging {
  explicit Swinging(double bucket_rad) : set_rad(bucket_rad), let_in_rad(bucket_rad), at_rad(bucket_rad + 0.03) {}

  /// @return how far the link stands from where it should be.
  double step() {
    constexpr double kInertia_kgm2 = 1200, kDamping = 0.03, kLag_s = 0.1;
    const CylinderState at = kinematics.cylinder_at(kBucket, at_rad).value();
    const double k = oil_stiffness_N_per_m(machine.cylinders[kBucket], machine.hydraulics, at.length_m);
    JointVector pose_rad = middle_of_range(machine);
    pose_rad[kBucket] = at_rad;
    estimation::JointState state = standing_at(pose_rad, kinematics);
    state.rate_radps[kBucket] = rate_radps;
    state.cylinder_N[kBucket] = k * at.lever_m * (let_in_rad - at_rad);
    JointCommand command{.position_rad = state.angle_rad, .active = true};
    command.position_rad[kBucket] = set_rad;
    const double asked_radps = control.step(state, {}, command, JointVector::Zero()).rate_radps[kBucket];
    valve_radps += kPeriod_s / kLag_s * (asked_radps - valve_radps);
    let_in_rad += kPeriod_s * valve_radps;
    const double w = std::abs(at.lever_m) * std::sqrt(k / kInertia_kgm2);
    rate_radps += kPeriod_s * (w * w * (let_in_rad - load_rad - at_rad) - 2 * kDamping * w * rate_radps);
    at_rad += kPeriod_s * rate_radps;
    return std::abs(at_rad - set_rad);
  }
  double largest(double time_s) {
    double most = 0;
    for (int i = 0; i < static_cast<int>(time_s / kPeriod_s); ++i) most = std::max(most, step());
    return most;
  }

  MachineDescription machine = load_machine(find_config("machine", "standard200"));
  Kinematics kinematics{machine};
  JointControl control{machine, kPeriod_s};
  double set_rad, let_in_rad, at_rad, rate_radps = 0, valve_radps = 0;
  double load_rad = 0;  ///< What the oil gives way to a load, standing.
};

TEST(JointSpeeds, TheLoopAddsNothingToASwingOnOil) {
  for (const double bucket_rad : {-2.3, -2.0, -1.5, -0.8, 0.0}) {
    Swinging bucket(bucket_rad);
    (void)bucket.largest(10);
    EXPECT_LT(bucket.largest(5), 0.01) << bucket_rad;
  }
}

/// Else a loaded joint would stand beside its set-point by all that its oil gives way.
TEST(JointSpeeds, WhatTheOilGivesWayToAStandingLoadIsNoErrorForLong) {
  Swinging bucket(-2.0);
  bucket.load_rad = 0.05;
  (void)bucket.largest(15);
  EXPECT_LT(bucket.largest(1), 0.01);
}

}  // namespace
}  // namespace knuckle::slave
