// What a gate says when it refuses or limits: code, subject, the value seen and its bound, in the unit of
// core/reason.h.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/slave/gate_bench.h"

namespace knuckle::slave {
namespace {

void expect_reason(const Reason& reason, ReasonCode code, int subject, double value, double limit) {
  EXPECT_EQ(reason.code, code) << text(reason);
  EXPECT_EQ(reason.subject, subject) << text(reason);
  if (std::isnan(value)) {
    EXPECT_TRUE(std::isnan(reason.value)) << text(reason);
  } else {
    EXPECT_NEAR(reason.value, value, 1e-5 * (1 + std::abs(value))) << text(reason);
  }
  EXPECT_NEAR(reason.limit, limit, 1e-5 * (1 + std::abs(limit))) << text(reason);
}

using GateReasons = GateBench;

TEST_F(GateReasons, CommandsThatAreNoneNameTheirJoint) {
  for (int joint = 0; joint < kJoints; ++joint) {
    expect_reason(gate(only(joint, kNan)).fault, ReasonCode::kCommandInvalid, joint, kNan, 1);
    expect_reason(gate(only(joint, -0.3), Mode::kReady).fault, ReasonCode::kCommandInvalid, joint, -0.3, 0);
  }
}

TEST_F(GateReasons, AgesAreInMilliseconds) {
  setpoint_at = now + 3ms;
  expect_reason(gate(only(kArm, 0.2)).fault, ReasonCode::kSetpointInvalid, 0, -3, 0);
  setpoint_at = now - 250ms;
  expect_reason(gate(only(kArm, 0.2)).fault, ReasonCode::kLinkLost, 0, 250, 200);
  setpoint_at = now;
  state.oldest_at = now - 30ms;
  expect_reason(gate(only(kArm, 0.2)).fault, ReasonCode::kSensorStale, 0x23, 30, 25);
  state.oldest_at = now + 30ms;
  expect_reason(gate(only(kArm, 0.2)).fault, ReasonCode::kSensorInvalid, 0x23, 0, 0);
}

TEST_F(GateReasons, JointLimitsAreInDegrees) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const bool upper : {false, true}) {
      const double bound = upper ? limits.max_rad[joint] : limits.min_rad[joint];
      JointVector angle(0.3, -1.5, -0.8);
      angle[joint] = bound - (upper ? 0.001 : -0.001);
      place(angle);
      const double outward = (state.lever_m[joint] > 0) == upper ? 0.3 : -0.3;
      expect_reason(gate(only(joint, outward)).limiting, ReasonCode::kJointLimit, joint, angle[joint] * kDegrees,
                    bound * kDegrees);
    }
  }
}

TEST_F(GateReasons, VirtualWallsAreInMetresOfTheTip) {
  const PlanarVector tip = limits.kinematics.tip(state.angle_rad);
  const struct {
    double LimitsDescription::*limit;
    double bound_m;
    double seen_m;
    int subject;
    double outward;  // of the boom; up, and with the tip below its pin away from the machine
  } walls[] = {{&LimitsDescription::floor_m, tip.y() - 0.01, tip.y(), 0, -0.6},
               {&LimitsDescription::ceiling_m, tip.y() + 0.01, tip.y(), 1, 0.6},
               {&LimitsDescription::reach_m, tip.x() + 0.01, tip.x(), 2, tip.y() < 0 ? 0.6 : -0.6}};
  for (const auto& wall : walls) {
    MachineDescription machine = test::test_machine();
    machine.limits.*wall.limit = wall.bound_m;
    limits = GateLimits(machine);
    expect_reason(gate(only(kBoom, wall.outward)).limiting, ReasonCode::kVirtualWall, wall.subject, wall.seen_m,
                  wall.bound_m);
  }
}

TEST_F(GateReasons, PressuresAreInBar) {
  for (std::size_t chamber = 0; chamber < 6; ++chamber) {
    const double before = state.pressure_Pa[chamber];
    state.pressure_Pa[chamber] = 245e5;
    limits.file.power_W = 1e9;
    const auto joint = static_cast<int>(chamber / 2);
    expect_reason(gate(only(joint, chamber % 2 == 0 ? 0.3 : -0.3)).limiting, ReasonCode::kPressureLimit,
                  static_cast<int>(chamber), 245, 240);
    state.pressure_Pa[chamber] = before;
  }
}

TEST_F(GateReasons, PowerIsInKilowatts) {
  state.pressure_Pa[0] = 200e5;
  const double flow = 0.5e-3 * std::sqrt(17.0 / 15.0);  // less than the pump has
  expect_reason(gate(only(kBoom, 1)).limiting, ReasonCode::kPowerLimit, 0, flow * 217e5 / 1e3, 8);
  // Two that ask for more than the pump has: what it gives counts.
  limits.min_rad.setConstant(-10);
  limits.max_rad.setConstant(10);
  expect_reason(gate(JointVector(1, 1, 0)).limiting, ReasonCode::kPowerLimit, 0, 32e-3 / 60 * 217e5 / 1e3, 8);
}

TEST_F(GateReasons, PowerAtTheLimitItselfIsPassed) {
  // Half open without a dead band, nothing carried, and numbers that binary fractions say exactly: 0.5 m3/s at 2^20 Pa.
  state.pressure_Pa.fill(0);
  limits.min_rad.setConstant(-1e9);
  limits.max_rad.setConstant(1e9);
  for (ValveDescription& valve : limits.valve) {
    valve.dead_band_extend = valve.dead_band_retract = 0;
    valve.nominal_flow_m3ps = 1;
    valve.nominal_drop_Pa = 1024 * 1024;
  }
  limits.load_sensing_margin_Pa = 1048576;
  limits.pump_flow_m3ps = 10;
  limits.file.power_W = 524288;
  EXPECT_FALSE(gate(only(kArm, 0.5)).limiting);
  limits.file.power_W = 524287.5;
  expect_reason(gate(only(kArm, 0.5)).limiting, ReasonCode::kPowerLimit, 0, 524.288, 524.2875);
}

TEST_F(GateReasons, TheFirstLimitIsTold) {
  MachineDescription machine = test::test_machine();
  machine.limits.floor_m = limits.kinematics.tip(state.angle_rad).y() - 0.01;
  limits = GateLimits(machine);
  state.pressure_Pa[1] = 245e5;
  const GateResult r = gate(only(kBoom, -0.6));
  EXPECT_EQ(r.limiting.code, ReasonCode::kVirtualWall);
  EXPECT_EQ(r.limits, kLimitVirtualWall | kLimitPressure);
}

class JogReasons : public JogGateBench {
 protected:
  void expect_fault(ReasonCode code, int subject, double value, double limit, double asked = 0.2) {
    expect_reason(gate_from_memory(only(kArm, asked)).fault, code, subject, value, limit);
  }
};

TEST_F(JogReasons, CommandsNameTheirJointAndWhatItMayHave) {
  expect_fault(ReasonCode::kCommandInvalid, kArm, 0.4, 0.35, 0.4);
  expect_reason(gate_from_memory(only(kBucket, 0.1)).fault, ReasonCode::kCommandInvalid, kBucket, 0.1, 0);
}

TEST_F(JogReasons, EmergencyStopNeedsNoFigure) {
  state.e_stop_open = true;
  expect_fault(ReasonCode::kEmergencyStop, 0, 0, 0);
}

TEST_F(JogReasons, TimesAreInMillisecondsAndOfAMotionInSeconds) {
  memory.at = now - 60ms;
  expect_fault(ReasonCode::kLoopOverrun, 0, 60, 50);
  memory.at = now - 5ms;
  state.since = now - 100s;
  expect_fault(ReasonCode::kJogTooLong, 0, 100, 90);
  state.since = now - 1s;
  state.oldest_at = now - 30ms;
  expect_fault(ReasonCode::kSensorStale, 0x23, 30, 25);
  state.oldest_at = now + 30ms;
  expect_fault(ReasonCode::kSensorInvalid, 0x23, 0, 0);
}

TEST_F(JogReasons, SensorsAreNamedByTheirNodes) {
  state.invalid_subject = 0x31;
  expect_fault(ReasonCode::kSensorInvalid, 0x31, 1, 0);
}

TEST_F(JogReasons, TravelIsInMillimetresAndPressureInBar) {
  state.travelled_m[kBoom] = -0.012;
  expect_fault(ReasonCode::kJogOtherMoves, kBoom, 12, 10);
  state.travelled_m[kBoom] = 0;
  state.pressure_Pa[4] = 250e5;
  expect_fault(ReasonCode::kPressureLimit, 4, 250, 240);
}

}  // namespace
}  // namespace knuckle::slave
