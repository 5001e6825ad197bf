// The gate's limits, stated again as numbers and swept densely across their borders. Each rule has a test that fails
// without it: "AllowsJustInside / Stops" pairs differ in nothing but the value the rule looks at.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/units.h"
#include "tests/slave/gate_bench.h"
#include "tests/support/no_alloc.h"

namespace knuckle::slave {
namespace {

constexpr double kDeadBand = 0.11;

using SafetyGate = GateBench;

TEST_F(SafetyGate, PassesOrdinaryCommandsUntouched) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<> u(-0.25, 0.25);
  for (int i = 0; i < 2000; ++i) {
    const JointVector wanted(u(rng), u(rng), u(rng));
    const GateResult r = gate(wanted);
    EXPECT_EQ(r.commands, wanted);
    EXPECT_EQ(r.limits, 0);
    EXPECT_FALSE(r.fault);
    EXPECT_FALSE(r.limiting);
  }
}

TEST_F(SafetyGate, CommandsNeutralForAnyNonFiniteCommand) {
  for (const double bad : {kNan, -kNan, kInf, -kInf}) {
    for (int joint = 0; joint < kJoints; ++joint) {
      JointVector wanted(0.2, -0.2, 0.2);
      wanted[joint] = bad;
      expect_reason(refused(wanted), ReasonCode::kCommandInvalid, joint, bad, 1);
    }
  }
}

TEST_F(SafetyGate, CommandsNeutralOutsideEngagedWhateverIsAsked) {
  for (int m = 0; m <= static_cast<int>(Mode::kEStop); ++m) {
    const auto mode = static_cast<Mode>(m);
    if (mode == Mode::kEngaged) {
      EXPECT_FALSE(gate(only(kArm, 1e-6), mode).fault);
      continue;
    }
    expect_reason(refused(only(kArm, 1e-6), mode), ReasonCode::kCommandInvalid, kArm, 1e-6, 0);
    expect_reason(refused(only(kBoom, -0.3), mode), ReasonCode::kCommandInvalid, kBoom, -0.3, 0);
    const GateResult neutral = gate(JointVector::Zero(), mode);
    EXPECT_EQ(neutral.commands, JointVector(0, 0, 0));
    EXPECT_FALSE(neutral.fault);
  }
}

TEST_F(SafetyGate, CommandsNeutralWhenSetpointIsOlderThanItsLimit) {
  for (Duration age = 0ms; age < 400ms; age += 250us) {
    setpoint_at = now - age;
    const GateResult r = gate(JointVector(0.2, 0.2, 0.2));
    if (age < 200ms) {
      EXPECT_FALSE(r.fault);
      EXPECT_EQ(r.commands, JointVector(0.2, 0.2, 0.2));
    } else {
      expect_reason(refused(), ReasonCode::kLinkLost, 0, 1e3 * to_seconds(age), 200);
    }
  }
  setpoint_at = kNever;
  EXPECT_TRUE(test::is(refused(), ReasonCode::kLinkLost));
}

TEST_F(SafetyGate, CommandsNeutralWhenStateIsOlderThanItsLimit) {
  for (Duration age = 0ms; age < 60ms; age += 100us) {
    state.oldest_at = now - age;
    if (age <= 25ms) {
      EXPECT_FALSE(gate(JointVector(0.2, 0.2, 0.2)).fault);
    } else {
      expect_reason(refused(), ReasonCode::kSensorStale, 0x23, 1e3 * to_seconds(age), 25);
    }
  }
}

TEST_F(SafetyGate, CommandsNeutralForStampsFromTheFuture) {
  for (const Duration ahead : {Duration(1ns), Duration(3ms)}) {
    setpoint_at = now + ahead;
    expect_reason(refused(), ReasonCode::kSetpointInvalid, 0, -1e3 * to_seconds(ahead), 0);
    setpoint_at = now;
    state.oldest_at = now + ahead;
    expect_reason(refused(), ReasonCode::kSensorInvalid, 0x23, 0, 0);
    state.oldest_at = now;
  }
}

TEST_F(SafetyGate, CommandsNeutralWithoutAFiniteValidState) {
  const GateState good = state;
  const auto refused_with = [&](double& value, double bad) {
    value = bad;
    EXPECT_TRUE(test::is(refused(), ReasonCode::kSensorInvalid));
    state = good;
    EXPECT_FALSE(gate(JointVector(0.2, 0.2, 0.2)).fault);
  };
  for (int i = 0; i < kJoints; ++i) {
    refused_with(state.angle_rad[i], kNan);
    refused_with(state.lever_m[i], kInf);
  }
  for (double& pressure_Pa : state.pressure_Pa) refused_with(pressure_Pa, kNan);
  state.valid = false;
  EXPECT_TRUE(test::is(refused(), ReasonCode::kSensorInvalid));
}

TEST_F(SafetyGate, ClampsMagnitudeToFullStrokeAndSaysSo) {
  limits.file.power_W = 1e9;
  for (int joint = 0; joint < kJoints; ++joint) {
    for (double u = -3; u <= 3; u += 0.01) {
      const GateResult r = gate(only(joint, u));
      EXPECT_LE(std::abs(r.commands[joint]), 1.0);
      EXPECT_EQ((r.limits & kLimitMagnitude) != 0, std::abs(u) > 1.0) << u;
    }
  }
}

TEST_F(SafetyGate, OpensSlowlyAndClosesAtOnce) {
  // 5 of stroke per second: 0.025 a step of 5 ms beyond the dead band or what is open already.
  for (const double sign : {-1.0, 1.0}) {
    for (double from = 0; from <= 0.45; from += 0.01) {
      for (double to = 0; to <= 0.6; to += 0.01) {
        memory = {JointVector::Constant(sign * from), now - 5ms};
        const GateResult r = gate_from_memory(JointVector::Constant(sign * to));
        const double most = std::max(from, kDeadBand) + 0.025;
        EXPECT_NEAR(r.commands[kBoom], sign * std::min(to, most), 1e-12) << from << " " << to;
        EXPECT_EQ((r.limits & kLimitRate) != 0, to > most);
      }
    }
  }
}

TEST_F(SafetyGate, EachDirectionHasItsOwnDeadBand) {
  MachineDescription machine = test::test_machine();
  for (CylinderDescription& cylinder : machine.cylinders) {
    cylinder.valve.dead_band_extend = 0.08;
    cylinder.valve.dead_band_retract = 0.16;
  }
  remake(machine);
  memory = {JointVector::Zero(), now - 5ms};
  for (int joint = 0; joint < kJoints; ++joint) {
    EXPECT_NEAR(gate_from_memory(only(joint, 0.6)).commands[joint], 0.08 + 0.025, 1e-12);
    EXPECT_NEAR(gate_from_memory(only(joint, -0.6)).commands[joint], -(0.16 + 0.025), 1e-12);
  }
}

TEST_F(SafetyGate, ReversingPassesThroughZeroAndOpensSlowly) {
  memory = {only(kArm, 0.6), now - 5ms};
  EXPECT_NEAR(gate_from_memory(only(kArm, -0.6)).commands[kArm], -(kDeadBand + 0.025), 1e-12);
}

TEST_F(SafetyGate, LateLoopGetsNoBiggerJump) {
  memory = {JointVector::Zero(), now - 10s};
  EXPECT_NEAR(gate_from_memory(only(kArm, 0.9)).commands[kArm], kDeadBand + 5 * 0.020, 1e-12);
  memory = {JointVector::Zero(), now + 10s};
  EXPECT_NEAR(gate_from_memory(only(kArm, 0.9)).commands[kArm], kDeadBand, 1e-12);
}

TEST_F(SafetyGate, NeverMovesAJointFurtherOutOfItsRange) {
  const double min[] = {-0.474, -2.585, -2.5}, max[] = {1.092, -0.510, 0.784};
  for (int joint = 0; joint < kJoints; ++joint) {
    for (double over = -0.02; over <= 0.02; over += 0.0005) {
      for (const bool upper : {false, true}) {
        JointVector angle(0.3, -1.5, -0.8);
        const double bound = upper ? max[joint] : min[joint];
        angle[joint] = upper ? bound + over : bound - over;
        // Levers of the nearest pose in range: past it the linkage may not exist.
        place(JointVector(0.3, -1.5, -0.8));
        state.lever_m[joint] = limits.kinematics.cylinder_at(joint, bound).value().lever_m;
        state.angle_rad = angle;
        const double outward = (state.lever_m[joint] > 0) == upper ? 0.2 : -0.2;
        const GateResult out = gate(only(joint, outward)), in = gate(only(joint, -outward));
        EXPECT_EQ(in.commands[joint], -outward) << joint << " " << over;
        EXPECT_EQ(in.limits & kLimitJointRange, 0);
        if (over >= 0) {
          EXPECT_EQ(out.commands[joint], 0) << joint << " " << over;
        } else {
          EXPECT_NE(out.commands[joint], 0);
        }
        if (over > -0.005) {
          EXPECT_NE(out.limits & kLimitJointRange, 0);
          expect_reason(out.limiting, ReasonCode::kJointLimit, joint, angle[joint] / kDegree, bound / kDegree);
        }
      }
    }
  }
}

// Joint speed at an opening: the valve's 30 L/min at 15 bar, from what the pump supplies (17 bar over the highest
// driven chamber) and never more than it has.
TEST_F(SafetyGate, OutwardSpeedAllowsToStopWithinWhatIsLeftOfTheRange) {
  const double pi4 = 3.14159265358979 / 4, bore[] = {0.065, 0.060, 0.060};
  limits.file.power_W = 1e9;
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const bool upper : {false, true}) {
      for (const double others_Pa : {0.0, 150e5}) {
        // 0.01 rad left over 0.1 s: at most 0.1 rad/s.
        JointVector angle(0.3, -1.5, -0.8);
        angle[joint] = upper ? limits.max_rad[joint] - 0.01 : limits.min_rad[joint] + 0.01;
        place(angle);
        state.pressure_Pa.fill(30e5);
        const int other = (joint + 1) % kJoints;
        const bool extends = (state.lever_m[joint] > 0) == upper;
        JointVector wanted = only(joint, extends ? 1 : -1);
        if (others_Pa > 0) {
          wanted[other] = 0.2;
          state.pressure_Pa[static_cast<std::size_t>(2 * other)] = others_Pa;
        }
        const GateResult r = gate(wanted);
        const double supply_Pa = std::max(30e5, others_Pa) + 17e5;
        const double flow = std::min(0.5e-3 * std::sqrt((supply_Pa - 30e5) / 15e5), 32e-3 / 60);
        const double area = pi4 * (bore[joint] * bore[joint] - (extends ? 0 : 0.035 * 0.035));
        const double opening = (std::abs(r.commands[joint]) - kDeadBand) / (1 - kDeadBand);
        EXPECT_NEAR(opening * flow / area / std::abs(state.lever_m[joint]), 0.1, 1e-6) << joint << upper << others_Pa;
      }
    }
  }
}

TEST_F(SafetyGate, VirtualWallsForbidEveryPartThatMovesTheTipFurtherIn) {
  struct Wall {
    double LimitsDescription::*limit;
    int axis;
    double outward;  // sign of the axis that leaves the wall
    int subject;
  };
  const Wall walls[] = {{&LimitsDescription::floor_m, 1, 1, 0},
                        {&LimitsDescription::ceiling_m, 1, -1, 1},
                        {&LimitsDescription::reach_m, 0, -1, 2}};
  const LimitsDescription unwalled = limits.file;
  std::mt19937 rng(3);
  std::uniform_real_distribution<> u(-0.25, 0.25), part(0.1, 0.9);
  for (const Wall& wall : walls) {
    for (int draw = 0; draw < 500; ++draw) {
      place(JointVector(-0.474 + 1.566 * part(rng), -2.585 + 2.075 * part(rng), -2.5 + 3.284 * part(rng)));
      const double at = limits.kinematics.tip(state.angle_rad)[wall.axis];
      const auto jacobian = limits.kinematics.tip_jacobian(state.angle_rad);
      const JointVector wanted(u(rng), u(rng), u(rng));

      limits.file = unwalled;
      limits.file.*wall.limit = at + wall.outward * 0.01;  // 1 cm inside the wall
      const GateResult inside = gate(wanted);
      for (int i = 0; i < kJoints; ++i) {
        const double leaves = wall.outward * jacobian(wall.axis, i) * wanted[i] / state.lever_m[i];
        EXPECT_EQ(inside.commands[i], leaves >= 0 ? wanted[i] : 0);
        if (leaves < 0) {
          EXPECT_NE(inside.limits & kLimitVirtualWall, 0);
          expect_reason(inside.limiting, ReasonCode::kVirtualWall, wall.subject, at, limits.file.*wall.limit);
        }
      }
      limits.file.*wall.limit = at - wall.outward * 3;  // 3 m away from it
      EXPECT_EQ(gate(wanted).limits & kLimitVirtualWall, 0);
    }
  }
}

TEST_F(SafetyGate, TipSpeedTowardsAWallAllowsToStopInFrontOfIt) {
  MachineDescription machine = test::test_machine();
  machine.limits.floor_m = limits.kinematics.tip(state.angle_rad).y() - 0.03;
  remake(machine);
  const GateResult r = gate(only(kBoom, -0.6));  // lowers
  EXPECT_NE(r.limits & kLimitVirtualWall, 0);
  EXPECT_LT(r.commands[kBoom], -kDeadBand);
  EXPECT_GT(r.commands[kBoom], -0.6);
  // A third of 3 cm over 0.15 s, whatever the lever: 0.067 m/s of the tip downwards by the boom alone.
  const double rod_area = 3.14159265358979 / 4 * (0.065 * 0.065 - 0.035 * 0.035);
  const double opening = (-r.commands[kBoom] - kDeadBand) / (1 - kDeadBand);
  const double full_mps = std::min(0.5e-3 * std::sqrt(17.0 / 15.0), 32e-3 / 60) / rod_area;
  const double tip_per_rad = limits.kinematics.tip_jacobian(state.angle_rad)(1, kBoom);
  EXPECT_NEAR(opening * full_mps / std::abs(state.lever_m[kBoom]) * std::abs(tip_per_rad), 0.03 / (3 * 0.15), 1e-4);
  EXPECT_EQ(gate(only(kBoom, 0.2)).limits, 0);  // raising is free
}

TEST_F(SafetyGate, ACylinderWithoutALeverTurnsNothing) {
  MachineDescription machine = test::test_machine();
  machine.limits.floor_m = limits.kinematics.tip(state.angle_rad).y() + 0.01;  // the tip is beyond it
  remake(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const double u : {0.2, -0.2}) {
      place(JointVector(0.3, -1.5, -0.8));
      state.angle_rad[joint] = limits.max_rad[joint] + 0.01;
      state.lever_m[joint] = 0;
      const GateResult r = gate(only(joint, u));
      EXPECT_EQ(r.commands[joint], u) << joint;
      EXPECT_EQ(r.limits, 0);
    }
  }
}

// Whatever comes in: never more than asked, never the other way, never non-finite, and every change is flagged.
TEST_F(SafetyGate, OnlyEverTakesAwayAndNeverSilently) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<> u(-1.5, 1.5), part(-0.05, 1.05), bar(0, 260);
  MachineDescription machine = test::test_machine();
  machine.limits.floor_m = -0.5;
  machine.limits.ceiling_m = 2.0;
  machine.limits.reach_m = 2.5;
  remake(machine);
  for (int i = 0; i < 20000; ++i) {
    state.angle_rad = JointVector(-0.474 + 1.566 * part(rng), -2.585 + 2.075 * part(rng), -2.5 + 3.284 * part(rng));
    state.lever_m = JointVector(0.2, -0.2, -0.1);
    for (double& p : state.pressure_Pa) p = bar(rng) * 1e5;
    memory.sent = JointVector(u(rng), u(rng), u(rng)).cwiseMin(1).cwiseMax(-1);
    const JointVector wanted(u(rng), u(rng), u(rng));
    const GateResult r = gate_from_memory(wanted);
    EXPECT_FALSE(r.fault);
    EXPECT_EQ(r.commands != wanted, r.limits != 0);
    for (int j = 0; j < kJoints; ++j) {
      EXPECT_LE(std::abs(r.commands[j]), std::min(1.0, std::abs(wanted[j])));
      EXPECT_GE(r.commands[j] * wanted[j], 0);
    }
  }
}

// Whatever the rest of the program believes: random modes, ages and states, with what cannot be among them.
TEST_F(SafetyGate, OpensOnlyWhileEngagedOnFreshSetPointsAndSensors) {
  std::mt19937 rng(12);
  const auto draw = [&rng](double low, double high) { return std::uniform_real_distribution<>(low, high)(rng); };
  constexpr std::array<double, 3> kNoNumbers{std::nan(""), HUGE_VAL, -HUGE_VAL};
  const auto no_number = [&] { return kNoNumbers[static_cast<std::size_t>(draw(0, 2.999))]; };
  int opened = 0;
  for (int i = 0; i < 20000; ++i) {
    const Mode mode = draw(0, 1) < 0.7 ? Mode::kEngaged : static_cast<Mode>(static_cast<int>(draw(0, 7.999)));
    place(JointVector(draw(-0.474, 1.092), draw(-2.585, -0.51), draw(-2.5, 0.784)));
    for (double& p : state.pressure_Pa) p = draw(0, 400e5);
    state.valid = draw(0, 1) < 0.95;
    state.oldest_at = now - from_seconds(draw(-0.002, 0.04));
    setpoint_at = now - from_seconds(draw(-0.005, 0.25));
    memory = {JointVector(draw(-1, 1), draw(-1, 1), draw(-1, 1)), now - from_seconds(draw(0, 0.05))};
    JointVector wanted(draw(-1.5, 1.5), draw(-1.5, 1.5), draw(-1.5, 1.5));
    if (draw(0, 1) < 0.05) wanted[static_cast<int>(draw(0, 2.999))] = no_number();
    if (draw(0, 1) < 0.05) state.pressure_Pa[static_cast<std::size_t>(draw(0, 5.999))] = no_number();
    if (draw(0, 1) < 0.05) state.angle_rad[static_cast<int>(draw(0, 2.999))] = no_number();
    const GateResult r = gate_from_memory(wanted, mode);
    bool finite = state.angle_rad.allFinite() && wanted.allFinite();
    for (const double p : state.pressure_Pa) finite = finite && std::isfinite(p);
    const bool fresh = setpoint_at <= now && now - setpoint_at < 200ms && state.oldest_at <= now &&
                       now - state.oldest_at <= limits.state_age;
    if (mode != Mode::kEngaged || !state.valid || !finite || !fresh) {
      ASSERT_EQ(r.commands, JointVector(0, 0, 0)) << i;
      ASSERT_TRUE(r.fault) << i;
      continue;
    }
    ASSERT_FALSE(r.fault) << text(r.fault);
    for (int j = 0; j < kJoints; ++j) {
      ASSERT_LE(std::abs(r.commands[j]), std::min(1.0, std::abs(wanted[j])));
      ASSERT_GE(r.commands[j] * wanted[j], 0);
      opened += r.commands[j] != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(opened, 1000) << "or this has tested nothing";
}

TEST_F(SafetyGate, AllocatesNothing) {
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) gate(JointVector(0.4, -0.9, 1.2));
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::slave
