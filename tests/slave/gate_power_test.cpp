// The gate's limits of pressure and power, stated again as numbers and swept densely across their borders.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/slave/gate_bench.h"

namespace knuckle::slave {
namespace {

constexpr double kBand = 0.11;

using GatePower = GateBench;

TEST_F(GatePower, NeverFeedsAChamberBeyondItsPressureLimit) {
  // 240 bar; fades over the last 10 bar.
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const double sign : {1.0, -1.0}) {
      const auto fed = static_cast<std::size_t>(2 * joint + (sign > 0 ? 0 : 1));
      for (double bar = 220; bar <= 260; bar += 0.25) {
        state.pressure_Pa = {60e5, 20e5, 50e5, 25e5, 40e5, 20e5};
        state.pressure_Pa[fed] = bar * 1e5;
        limits.file.power_W = 1e9;
        const GateResult r = gate(only(joint, sign * 0.6));
        const double opening = std::min((0.6 - kBand) / (1 - kBand), (240 - bar) / 10);
        const double expected = bar >= 240 ? 0 : kBand + opening * (1 - kBand);
        EXPECT_NEAR(r.commands[joint], sign * expected, 1e-9) << bar;
        const double full = bar >= 240 ? 0 : kBand + std::min(1.0, (240 - bar) / 10) * (1 - kBand);
        EXPECT_NEAR(gate(only(joint, sign)).commands[joint], sign * full, 1e-9) << "full stroke is no exception";
        EXPECT_EQ(gate(only(joint, -sign * 0.6)).commands[joint], -sign * 0.6) << "relieving must stay possible";
        if (bar >= 240) {
          EXPECT_NE(r.limits & kLimitPressure, 0);
          expect_reason(r.limiting, ReasonCode::kPressureLimit, static_cast<int>(fed), bar, 240);
        }
      }
    }
  }
}

TEST_F(GatePower, KeepsHydraulicPowerBelowItsLimit) {
  // 8 kW from a pump of 32 L/min: reached above 150 bar of supply only.
  for (double bar = 100; bar <= 200; bar += 1) {
    state.pressure_Pa[0] = bar * 1e5;
    const GateResult r = gate(JointVector(1, 0, 0));
    const double supply = (bar + 17) * 1e5, flow = 0.5e-3 * std::sqrt(17.0 / 15.0);
    const double opening = (r.commands[0] - kBand) / (1 - kBand);
    EXPECT_LE(opening * std::min(flow, 32e-3 / 60) * supply, 8000 * 1.001) << bar;
    EXPECT_EQ((r.limits & kLimitPower) != 0, std::min(flow, 32e-3 / 60) * supply > 8000) << bar;
  }
  state.pressure_Pa[0] = 200e5;
  const double flow = 0.5e-3 * std::sqrt(17.0 / 15.0);  // less than the pump has
  expect_reason(gate(JointVector(1, 0, 0)).limiting, ReasonCode::kPowerLimit, 0, flow * 217e5 / 1e3, 8);
  EXPECT_FALSE(gate(JointVector(0.3, 0, 0)).limits & kLimitPower);
}

TEST_F(GatePower, RetractingTakesPowerAsExtendingDoes) {
  limits.min_rad.setConstant(-10);
  limits.max_rad.setConstant(10);  // far from every end
  for (const double sign : {1.0, -1.0}) {
    state.pressure_Pa = {60e5, 20e5, 50e5, 25e5, 40e5, 20e5};
    state.pressure_Pa[sign > 0 ? 0 : 1] = 200e5;
    const GateResult r = gate(only(kBoom, sign));
    EXPECT_NE(r.limits & kLimitPower, 0) << sign;
    const double opening = (std::abs(r.commands[kBoom]) - kBand) / (1 - kBand);
    const double flow = 0.5e-3 * std::sqrt(17.0 / 15.0), supply = 217e5;
    EXPECT_NEAR(opening * flow * supply, 8000, 1) << sign;
  }
}

TEST_F(GatePower, SharesPowerAmongJointsByWhatTheyTake) {
  limits.min_rad.setConstant(-10);
  limits.max_rad.setConstant(10);  // far from every end
  state.pressure_Pa = {200e5, 20e5, 50e5, 25e5, 40e5, 214e5};
  const double supply = 217e5, full[] = {0.5e-3 * std::sqrt(17.0 / 15.0), 0.5e-3 * std::sqrt(167.0 / 15.0)};
  // Boom and arm; the bucket stays at the edge of its dead band and counts neither as flow nor as load.
  for (const double arm : {0.4, 0.7, 1.0}) {
    const GateResult r = gate(JointVector(0.9, arm, -kBand));
    const double asked[] = {(0.9 - kBand) / (1 - kBand), (arm - kBand) / (1 - kBand)};
    const double share = 8000 / ((asked[0] * full[0] + asked[1] * full[1]) * supply);
    for (int i = 0; i < 2; ++i) {
      const double opening = (r.commands[i] - kBand) / (1 - kBand);
      EXPECT_NEAR(opening, asked[i] * share, 1e-9) << i << " " << arm;
    }
    EXPECT_EQ(r.commands[kBucket], -kBand) << "closed valves are not limited";
  }
  state.pressure_Pa[5] = 20e5;  // two that ask for more than the pump has: what it gives counts
  expect_reason(gate(JointVector(1, 1, 0)).limiting, ReasonCode::kPowerLimit, 0, 32e-3 / 60 * 217e5 / 1e3, 8);
  // All that the pump has, at a pressure where that is below the limit: as many joints as like.
  state.pressure_Pa.fill(100e5);
  EXPECT_EQ(gate(JointVector(1, 1, 1)).limits, 0);
}

TEST_F(GatePower, TheFirstLimitIsTold) {
  MachineDescription machine = test::test_machine();
  machine.limits.floor_m = limits.kinematics.tip(state.angle_rad).y() - 0.01;
  limits = GateLimits(machine);
  state.pressure_Pa[1] = 245e5;
  const GateResult r = gate(only(kBoom, -0.6));
  EXPECT_TRUE(test::is(r.limiting, ReasonCode::kVirtualWall));
  EXPECT_EQ(r.limits, kLimitVirtualWall | kLimitPressure);
}

// A cylinder without transmitters: what stands in the place of its pressures decides nothing.
TEST_F(GatePower, PressuresThatNobodyMeasuresAreNotLookedAt) {
  for (int joint = 0; joint < kJoints; ++joint) {
    state.pressure_Pa = {60e5, 20e5, 50e5, 25e5, 40e5, 20e5};
    state.pressures_known = {true, true, true};
    state.pressures_known[static_cast<std::size_t>(joint)] = false;
    limits.pressures_measured = state.pressures_known;  // as the file says
    for (const double opening : {-1.0, -0.5, 0.3, 0.7, 1.0}) {
      GateResult zeros, high;
      for (const double other_Pa : {0.0, 300e5}) {
        for (int side = 0; side < 2; ++side) state.pressure_Pa[static_cast<std::size_t>(2 * joint + side)] = other_Pa;
        GateMemory before;
        before.sent = only(joint, opening);
        before.at = now - 5ms;
        (other_Pa == 0 ? zeros : high) =
            safety_gate(only(joint, opening), Mode::kEngaged, setpoint_at, state, before, limits, now);
      }
      EXPECT_EQ(zeros.commands.value(), high.commands.value()) << joint << ", " << opening;
      EXPECT_FALSE(high.fault);
      EXPECT_NE(high.commands.value()[joint], 0) << "it still moves";
    }
  }
}

// The pump is taken to be at its relief: no more power than the file's, whatever really pushes there.
TEST_F(GatePower, WithoutPressuresThePowerOfTheFileIsKeptAtThePumpsRelief) {
  limits.file.power_W = 3000;
  state.pressures_known[kBoom] = limits.pressures_measured[kBoom] = false;
  GateMemory before;
  before.sent = only(kBoom, 1);
  before.at = now - 5ms;
  const GateResult r = safety_gate(only(kBoom, 1), Mode::kEngaged, setpoint_at, state, before, limits, now);
  EXPECT_TRUE(r.limits & kLimitPower);
  const ValveDescription& valve = limits.valve[kBoom];
  const double flow_m3ps = valve.flow_share(valve.opening(r.commands.value()[kBoom]), true) * valve.nominal_flow_m3ps *
                           std::sqrt(limits.main_relief_Pa / valve.nominal_drop_Pa);
  EXPECT_LE(std::min(flow_m3ps, limits.pump_flow_m3ps) * limits.main_relief_Pa, 1.001 * limits.file.power_W);
}

}  // namespace
}  // namespace knuckle::slave
