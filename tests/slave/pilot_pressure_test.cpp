// A machine that is led by frames and measures the pressures that move its spools.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/slave/leading.h"
#include "tests/support/command_machine.h"
#include "tests/support/module_machine.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

constexpr std::uint32_t kPilotFrame = 0x18FF5021U | kExtendedId;

struct Piloted : test::BenchMachine {
  explicit Piloted(const std::string& commands = test::kPilotCommands,
                   const std::string& state = test::state_with_pilots())
      : Piloted(parse_machine(test::command_text(commands, state), "m.toml")) {}
  explicit Piloted(const MachineDescription& machine) : BenchMachine(machine) {}
  /// Engaged; then the arm moves like that.
  void lead_arm(double arm_radps, Duration time) {
    ASSERT_TRUE(engage()) << fault();
    move(JointVector(0, arm_radps, 0), time);
  }
  /// The arm goes on like that. @return until the fault; 3 s where there is none.
  Duration arm_until_fault(double arm_radps) {
    const Time since = now;
    while (loop.mode() == Mode::kEngaged && now < since + 3s) move(JointVector(0, arm_radps, 0), 1ms);
    return now - since;
  }
  /// The arm goes out, until its pilot valve fails and the hand does something else.
  Duration found_after(bool extend, sim::PilotFault how, double before_radps, double then_radps) {
    lead_arm(before_radps, 700ms);
    EXPECT_EQ(loop.mode(), Mode::kEngaged) << fault();
    EXPECT_TRUE(nodes.inject_pilot(kArm, extend, how));
    return arm_until_fault(then_radps);
  }
};

/// What extends the arm's cylinder turns it down.
constexpr double kOut = 0.3, kIn = -0.3;

/// Transmitters without supply: all say the highest, and their difference would be that of a shut spool.
void lose_supply(Piloted& m) {
  const auto& sent = m.description.bus.broadcasts;
  const auto pilots = std::find_if(sent.begin(), sent.end(), [](const auto& one) { return one.id == kPilotFrame; });
  m.nodes.inject_broadcast(static_cast<std::size_t>(pilots - sent.begin()), sim::BroadcastFault::kInvalid,
                           ~std::uint64_t{0});
}

/// The reading alone: the pressure goes on.
void freeze(Piloted& m, NodeRole role, int index) {
  const auto& sent = m.description.bus.broadcasts;
  const auto [frame, field] = m.description.bus.broadcast(role, index);
  m.nodes.inject_broadcast(static_cast<std::size_t>(frame - sent.data()), sim::BroadcastFault::kValuesFrozen,
                           std::uint64_t{1} << field->signal);
}

class PilotedBy : public testing::TestWithParam<const char*> {};

TEST_P(PilotedBy, IsLedAndShowsWhereItsSpoolsAre) {
  Piloted m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  double apart = 0;
  for (const double way : {1.0, -1.0, 1.0}) {
    for (int i = 0; i < 1000; ++i) {
      m.move(way * JointVector(0.1, -0.15, 0.2), 1ms);
      // A shut spool is somewhere inside its dead band.
      for (int joint = 0; joint < kJoints; ++joint) {
        const ValveDescription& valve = m.description.cylinders[static_cast<std::size_t>(joint)].valve;
        const auto open = [&](double spool) { return std::copysign(valve.opening(spool), spool); };
        if (i > 200) apart = std::max(apart, std::abs(open(m.loop.spool()[joint]) - open(m.signals.spool[joint])));
      }
    }
  }
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
  EXPECT_LT(apart, 0.1);
}

TEST_P(PilotedBy, AStaleOrInvalidPressureIsAFaultByName) {
  Piloted m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.can.lost = {kPilotFrame};
  m.run(70ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "sensor_stale: pilot_pressure (0x18FF5021), boom_extend_pilot: "));
}

TEST_P(PilotedBy, PressuresThatNoPilotStageHasAreNone) {
  Piloted m(GetParam());
  ASSERT_TRUE(m.engage()) << m.fault();
  lose_supply(m);
  m.run(60ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "sensor_invalid: pilot_pressure (0x18FF5021), boom_extend_pilot"));
}

INSTANTIATE_TEST_SUITE_P(Kinds, PilotedBy, testing::Values(test::kRateCommands, test::kPilotCommands),
                         [](const auto& kind) { return kind.index == 0 ? "JointRate" : "PilotPressure"; });

TEST(PilotPressure, APilotValveThatSticksIsFoundAtOnceAndNotByTheMotion) {
  Piloted m, blind(test::kPilotCommands, test::kStateBroadcast);
  const Duration found = m.found_after(true, sim::PilotFault::kStuck, kIn, 0);
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kValveNotFollowing, kArm));
  EXPECT_LE(found, 200ms);
  EXPECT_EQ(m.loop.commands(), JointVector::Zero());
  m.run(250ms);
  EXPECT_LT(std::abs(m.signals.spool[kArm]), m.description.cylinders[kArm].valve.dead_band_extend) << "it stands";
  const Duration before = blind.found_after(true, sim::PilotFault::kStuck, kIn, 0);
  EXPECT_GE(before, 1s) << "the other pilot valve pushes against it unseen";
  RecordProperty("with_ms", std::to_string(found / 1ms));
  RecordProperty("by_motion_ms", std::to_string(before / 1ms));
}

std::string wrong_reading(bool extend) {
  return std::string("sensor_implausible: pilot_pressure (0x18FF5021), ") +
         (extend ? "arm_extend_pilot" : "arm_retract_pilot") +
         ": sensor contradicts the others: check mounting and wiring; or the joint's position sensor is wrong, or its "
         "spool sticks";
}
constexpr const char* kWrongAngle =
    "sensor_implausible: front_angle (0x18FF1021), arm_angle: sensor contradicts the others: check mounting and "
    "wiring; or a reading of the joint's pilot pressures is wrong, or its spool sticks";

/// Behind a spool that was asked to be open it is the sensor that is wrong, also where its last bit lives on.
TEST(PilotPressure, APositionSensorThatStandsStillIsNamed) {
  const JointVector bit(0, 1e-4, 0);  // of the cylinder, as one of its angle
  for (const char* commands : {test::kPilotCommands, test::kRateCommands}) {
    for (const bool dithers : {false, true}) {
      Piloted m(commands);
      ASSERT_NO_FATAL_FAILURE(m.lead_arm(kOut, 400ms));
      m.blocked[kArm] = true;
      const Time since = m.now;
      for (double sign = 1; m.loop.mode() == Mode::kEngaged && m.now < since + 3s; sign = -sign) {
        if (dithers) m.signals.cylinder_m += sign * bit;
        m.move(JointVector(0, kOut, 0), 10ms);
      }
      EXPECT_EQ(m.fault(), kWrongAngle) << (dithers ? "dithers" : "stands");
      EXPECT_LT(m.now - since, 2s);
    }
  }
}

TEST(PilotPressure, AnAngleThatFrozeAsTheOperatorLetGoIsNamed) {
  for (const char* commands : {test::kPilotCommands, test::kRateCommands}) {
    for (const Duration earlier : {0ms, 20ms}) {
      Piloted m(commands);
      ASSERT_NO_FATAL_FAILURE(m.lead_arm(0.8, 700ms));
      freeze(m, NodeRole::kEncoder, kArm);
      m.move(JointVector(0, 0.8, 0), earlier);
      m.hand.enable = false;
      m.run(500ms);
      EXPECT_TRUE(m.fault() == kWrongAngle || !m.loop.fault()) << m.fault() << ", " << earlier / 1ms;
    }
  }
}

/// The arm does as it was told, by its angle, too.
TEST(PilotPressure, AReadingThatFrozeShutIsNamedAndNotThePositionSensor) {
  for (const bool extend : {false, true}) {
    Piloted m(test::kRateCommands);
    ASSERT_TRUE(m.engage()) << m.fault();
    freeze(m, NodeRole::kPilot, 2 * kArm + (extend ? 0 : 1));
    (void)m.arm_until_fault(extend ? kIn : kOut);
    EXPECT_EQ(m.fault(), wrong_reading(extend));
  }
}

/// Commands that are sent always keep the pilot pump on.
std::string sent_always() {
  return test::replaced(test::kPilotCommands, "while_led", "always");
}

TEST(PilotPressure, ThatStaysWhileNobodyLeadsIsAFault) {
  Piloted m(sent_always());
  ASSERT_NO_FATAL_FAILURE(m.lead_arm(kIn, 700ms));
  m.nodes.inject_pilot(kArm, true, sim::PilotFault::kStuck);
  m.hand.enable = false;
  m.run(250ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "valve_not_following: arm: "));
  EXPECT_TRUE(test::says(m.fault(), "; by its pilot pressures: check their sensors, too"));
}

Duration stopped_after(Piloted& m, OrderlyStop& stop) {
  m.hung = true;
  m.run(2ms);  // what was sent before
  stop.go_on_from(m.loop.client().command_frames());
  return test::take_out_of_service(m, stop);
}

TEST(PilotPressure, AnOrderlyStopWaitsUntilAllSpoolsAreShutAndNoLonger) {
  Piloted m(test::kRateCommands), blind(test::kRateCommands, test::kStateBroadcast);
  for (Piloted* one : {&m, &blind}) {
    ASSERT_TRUE(one->engage()) << one->fault();
    one->move(JointVector(0.15, 0, 0), 500ms);
  }
  OrderlyStop stop(m.description, m.can), unseen(blind.description, blind.can);
  const Duration waited = stopped_after(m, stop), patience = stopped_after(blind, unseen);
  EXPECT_LT(waited, 200ms);
  EXPECT_GE(patience, 320ms);
  EXPECT_EQ(stop.unconfirmed_valves(), PerJoint<bool>{});
  EXPECT_LT(std::abs(m.signals.spool[kBoom]), m.description.cylinders[kBoom].valve.dead_band_extend);
}

TEST(PilotPressure, AnOrderlyStopSaysWhichSpoolIsNotShut) {
  Piloted m(sent_always());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 500ms);
  m.nodes.inject_pilot(kBoom, true, sim::PilotFault::kStuck);
  OrderlyStop stop(m.description, m.can);
  (void)stopped_after(m, stop);
  EXPECT_EQ(stop.unconfirmed_valves(), (PerJoint<bool>{true, false, false}));
}

TEST(PilotPressure, AnOrderlyStopTakesNoPressureForAShutSpoolThatNoPilotStageHas) {
  Piloted m(test::kRateCommands);
  ASSERT_TRUE(m.engage()) << m.fault();
  lose_supply(m);
  OrderlyStop stop(m.description, m.can);
  (void)stopped_after(m, stop);
  EXPECT_EQ(stop.unconfirmed_valves(), (PerJoint<bool>{true, true, true}));
}

TEST(PilotPressure, HangsOnAModuleAsWell) {
  std::string inputs = test::kInputs;
  for (const char* line :
       {"7 = { signal = \"arm_extend_pilot\", range = \"0.5-4.5V\", counts_low = 3276, counts_high = 29490, low = 0, "
        "high = 50, unit = \"bar\", shut = 6, full = 24 }\n",
        "12 = { signal = \"arm_retract_pilot\", range = \"0.5-4.5V\", counts_low = 3276, counts_high = 29490, low = 0, "
        "high = 50, unit = \"bar\", shut = 6, full = 24 }\n"})
    inputs += line;
  Piloted m(parse_machine(test::module_text(test::kVoltageOutputs, inputs), "m.toml"));
  EXPECT_LE(m.found_after(true, sim::PilotFault::kStuck, kIn, 0), 200ms);
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kValveNotFollowing));
}

}  // namespace
}  // namespace knuckle::slave
