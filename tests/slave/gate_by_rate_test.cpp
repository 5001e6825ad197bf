// The gate where the command is a joint's speed: what passes is never faster than its limits allow.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slave/safety_gate.h"
#include "tests/support/command_machine.h"

namespace knuckle::slave {
namespace {

struct RateGate {
  GateResult pass(const JointVector& wanted) {
    state.valid = true;
    state.oldest_at = now;
    for (int i = 0; i < kJoints; ++i) state.lever_m[i] = kinematics.cylinder_at(i, state.angle_rad[i])->lever_m;
    // Opened long ago: the rate of opening is not what is looked at.
    return safety_gate(wanted, Mode::kEngaged, now, state, {wanted, now}, limits, now);
  }
  /// Of what passed [rad/s], in the joint's direction.
  [[nodiscard]] JointVector rates(const GateResult& result) const {
    JointVector rate;
    for (int i = 0; i < kJoints; ++i) {
      const double command = result.commands[i];
      rate[i] =
          std::copysign(std::abs(command) * machine.bus.full_rate_radps(i, command > 0), command * state.lever_m[i]);
    }
    return rate;
  }
  MachineDescription machine = test::command_machine();
  Kinematics kinematics{machine};
  GateLimits limits{machine};
  GateState state{.angle_rad = JointVector(0.3, -1.5, -0.8), .pressure_Pa = {60e5, 20e5, 60e5, 20e5, 60e5, 20e5}};
  Time now{1s};
};

TEST(GateByRate, PassesWhatIsWithinAllLimits) {
  RateGate gate;
  const JointVector wanted(0.2, -0.2, 0.1);
  EXPECT_EQ(gate.pass(wanted).commands, wanted);
}

TEST(GateByRate, IsNeverFasterThanTheJointsOwnLimitWhateverTheFullCommandIs) {
  RateGate gate;
  gate.limits.full_rate_radps = {JointVector::Constant(16), JointVector::Constant(16)};
  const GateResult result = gate.pass(JointVector(1, -1, 1));
  for (int i = 0; i < kJoints; ++i)
    EXPECT_LE(16 * std::abs(result.commands[i]), gate.limits.max_rate_radps[i] + 1e-9) << i;
  EXPECT_TRUE(result.limits & kLimitVelocity);
}

/// Boundary sweep: at what is left of a joint's range, the machine's own lag included, it stops within it.
TEST(GateByRate, SlowsDownTowardsTheEndOfTheRangeInTimeForTheMachinesLag) {
  RateGate gate;
  const double stop_s = gate.limits.table.range_stop_s + 0.01 + gate.limits.table.own_controller_s;
  for (const double left_rad : {0.2, 0.1, 0.05, 0.01, 0.0, -0.05}) {
    gate.state.angle_rad[kBoom] = gate.limits.max_rad[kBoom] - left_rad;
    const double sign = gate.kinematics.cylinder_at(kBoom, gate.state.angle_rad[kBoom])->lever_m > 0 ? 1 : -1;
    const GateResult out = gate.pass(JointVector(sign, 0, 0)), back = gate.pass(JointVector(-sign, 0, 0));
    EXPECT_LE(gate.rates(out)[kBoom], std::max(0.0, left_rad) / stop_s + 1e-9) << left_rad;
    EXPECT_NE(back.commands[kBoom], 0) << "the other way is free";
  }
}

TEST(GateByRate, NothingFeedsAChamberAtItsLimit) {
  RateGate gate;
  gate.state.pressure_Pa[0] = gate.limits.file.chamber_pressure_Pa;
  EXPECT_EQ(gate.pass(JointVector(0.5, 0, 0)).commands[kBoom], 0);
  EXPECT_NE(gate.pass(JointVector(-0.5, 0, 0)).commands[kBoom], 0);
}

TEST(GateByRate, HoldsThePowerByTheFlowThatTheSpeedsTake) {
  RateGate gate;
  gate.limits.file.power_W = 2000;
  gate.state.pressure_Pa = {150e5, 20e5, 150e5, 20e5, 150e5, 20e5};
  const GateResult result = gate.pass(JointVector(1, 1, 1));
  double flow_m3ps = 0;
  for (int i = 0; i < kJoints; ++i)
    flow_m3ps += std::abs(gate.rates(result)[i] * gate.state.lever_m[i]) * gate.limits.head_area_m2[i];
  EXPECT_LE(flow_m3ps * (150e5 + gate.limits.load_sensing_margin_Pa), 2000 * (1 + 1e-9));
  EXPECT_TRUE(result.limits & kLimitPower);
}

/// Seeded: no rule opens further than asked, and never the other way.
TEST(GateByRate, OnlyEverTakesAway) {
  std::mt19937 random(60);
  std::uniform_real_distribution<> share(-1, 1), pressure(0, 340e5);
  RateGate gate;
  for (int n = 0; n < 20000; ++n) {
    for (int i = 0; i < kJoints; ++i) {
      const double middle = (gate.limits.min_rad[i] + gate.limits.max_rad[i]) / 2,
                   half = (gate.limits.max_rad[i] - gate.limits.min_rad[i]) / 2;
      gate.state.angle_rad[i] = middle + 0.98 * share(random) * half;
    }
    for (double& chamber : gate.state.pressure_Pa) chamber = pressure(random);
    const JointVector wanted(share(random), share(random), share(random));
    const GateResult result = gate.pass(wanted);
    for (int i = 0; i < kJoints; ++i) {
      ASSERT_LE(std::abs(result.commands[i]), std::abs(wanted[i])) << n;
      ASSERT_GE(result.commands[i] * wanted[i], 0) << n;
    }
  }
}

}  // namespace
}  // namespace knuckle::slave
