// The controller that a simulated machine has by itself: what it takes for a command, and when it stops.
#include "sim/own_controller.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/j1939_machine.h"

namespace knuckle::sim {
namespace {

constexpr std::uint32_t kFront = 0x18FF0105U | kExtendedId, kSetting = 0x1A6, kPilot = 0x18FF0305U | kExtendedId;

std::uint8_t h2f(const std::array<std::uint8_t, 8>& data) {
  unsigned crc = 0xFF;
  const auto add = [&](unsigned byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80) != 0 ? (crc << 1 ^ 0x2F) & 0xFF : crc << 1;
  };
  for (std::size_t i = 0; i < 7; ++i) add(data[i]);
  add(0x21);
  return static_cast<std::uint8_t>(crc ^ 0xFF);
}

/// A joint that turns as its spool opens, and who tells the controller.
struct Commanded {
  explicit Commanded(const char* commands = test::kRateCommands)
      : machine(test::command_machine(commands)), controller(machine) {}
  void tick() {
    if (front && ticks % 10 == 0) controller.hear(*front, now);
    if (setting && ticks % 20 == 0) {
      std::array<std::uint8_t, 8> data{0, mode, 3, 0, 0, 0, count, 0};
      data[7] = static_cast<std::uint8_t>(h2f(data) + spoilt);
      controller.hear({kSetting, 8, data}, now);
      if (counts) count = static_cast<std::uint8_t>((count + 1) % 15);
    }
    const JointVector opening = controller.pilot() ? controller.spool_demand() : JointVector::Zero();
    for (int i = 0; i < kJoints; ++i) {
      const double open = std::max(0.0, std::abs(opening[i]) - 0.1);
      cylinder_mps[i] = std::copysign(gain_mps * open, opening[i]);
      shaft_rad[i] += (i == kBoom ? 1 : -1) * cylinder_mps[i] / 0.3 * 1e-3;
    }
    controller.step(now, {shaft_rad, cylinder_mps, JointVector(0.3, -0.3, -0.3), {60e5, 20e5, 60e5, 20e5, 60e5, 20e5}});
    now += 1ms;
    ++ticks;
  }
  void run(Duration time) {
    for (const Time end = now + time; now < end;) tick();
  }
  MachineDescription machine;
  OwnController controller;
  // Boom 0, arm -0.45 rad/s, which extends; bucket and slew 0.
  std::optional<CanFrame> front = CanFrame{kFront, 8, {0x00, 0x7D, 0x7C, 0x79, 0, 0, 0x00, 0x7D}};
  bool setting = true, counts = true;
  std::uint8_t mode = 2, count = 0, spoilt = 0;
  double gain_mps = 0.3;
  JointVector shaft_rad = JointVector::Zero(), cylinder_mps = JointVector::Zero();
  Time now{1s};
  long ticks = 0;
};

TEST(OwnController, OpensFurtherWhereTheJointIsSlowerThanToldAndLessWhereItIsFaster) {
  for (const double gain_mps : {0.0, 3.0}) {
    Commanded machine;
    machine.gain_mps = gain_mps;
    machine.run(1s);
    const double before = machine.controller.spool_demand()[kArm];
    EXPECT_GT(before, 0.1) << "out of the dead band";
    machine.run(1s);
    const double after = machine.controller.spool_demand()[kArm];
    EXPECT_TRUE(gain_mps == 0 ? after > before : after < before) << before << " -> " << after;
    EXPECT_EQ(machine.shaft_rad[kBoom], 0);
    EXPECT_EQ(machine.shaft_rad[kBucket], 0);
  }
}

TEST(OwnController, ComesBackAtOnceFromWhatHeldTheJointForLong) {
  Commanded machine;
  machine.gain_mps = 0;
  machine.run(20s);
  machine.gain_mps = 0.3;
  const double before_rad = machine.shaft_rad[kArm];
  machine.front->data[2] = 0x58, machine.front->data[3] = 0x7F;  // 0.3 rad/s
  machine.run(500ms);
  EXPECT_GT(machine.shaft_rad[kArm], before_rad + 0.05);
}

TEST(OwnController, OpensAsItsMakersMeasuredTheEdges) {
  const ValveRoughness notched{.curve_exponent = 1.8, .notch_opening = 0.4, .notch_slope = 0.3};
  const auto opens = [](const ValveRoughness& edges, bool retracts = false) {
    Commanded machine;
    if (retracts) machine.front->data[2] = 0x58, machine.front->data[3] = 0x7F;  // 0.3 rad/s
    machine.controller.measured({edges, edges, edges});
    machine.run(30ms);
    return machine.controller.spool_demand()[kArm];
  };
  EXPECT_GT(opens(notched), opens({}) + 0.05);
  EXPECT_LT(opens({.retract_gain = 0.8}, true), opens({.retract_gain = 1.4}, true) - 0.01) << "smaller edges, further";
  EXPECT_EQ(opens({.retract_gain = 0.8}), opens({}));
}

TEST(OwnController, MovesNothingUnlessEveryConstantSaysThatItIsLed) {
  Commanded machine;
  machine.mode = 1;
  machine.run(500ms);
  EXPECT_FALSE(machine.controller.pilot());
  EXPECT_EQ(machine.shaft_rad, JointVector::Zero());
  machine.mode = 2;
  machine.run(100ms);
  EXPECT_TRUE(machine.controller.pilot());
}

TEST(OwnController, StopsByItselfWhenFramesEndOrSayNothingNew) {
  struct Case {
    const char* what;
    void (*spoil)(Commanded&);
  };
  for (const Case& c : {Case{"no speeds", [](Commanded& m) { m.front.reset(); }},
                        {"no setting", [](Commanded& m) { m.setting = false; }},
                        {"a counter that stands", [](Commanded& m) { m.counts = false; }},
                        {"a wrong checksum", [](Commanded& m) { m.spoilt = 1; }},
                        {"short frames", [](Commanded& m) { m.front->size = 7; }},
                        {"E-stop", [](Commanded& m) { m.controller.set_estop(true); }}}) {
    Commanded machine;
    machine.run(1s);
    ASSERT_TRUE(machine.controller.pilot()) << c.what;
    c.spoil(machine);
    machine.run(90ms);  // the newest frame is up to 20 ms old, and 60 ms is as long as three of them
    EXPECT_FALSE(machine.controller.pilot()) << c.what;
    EXPECT_EQ(machine.controller.spool_demand(), JointVector::Zero()) << c.what;
  }
}

TEST(OwnController, MovesPilotValvesAsFarAsItIsTold) {
  Commanded machine(test::kPilotCommands);
  machine.front = CanFrame{kPilot, 6, {0, 100, 50, 0, 0, 200}};
  machine.setting = false;
  machine.run(100ms);
  EXPECT_TRUE(machine.controller.pilot());
  EXPECT_NEAR(machine.controller.spool_demand()[kBoom], -0.5, 1e-9) << "20 of 40 bar";
  EXPECT_NEAR(machine.controller.spool_demand()[kArm], 0.25, 1e-9);
  EXPECT_NEAR(machine.controller.spool_demand()[kBucket], -1, 1e-9);
}

/// Auxiliary valves of ISO 11783-7: how much flow, and which way; float and what is none are blocked.
TEST(OwnController, OfAuxiliaryValvesTakesTheFlowAndTheWaysThatItKnows) {
  const MachineDescription machine = test::valves_machine();
  const auto demand = [&](std::uint8_t flow, std::uint8_t state) {
    OwnController controller(machine);
    for (const std::uint32_t id : {0x0CFE3326U, 0x0CFE3026U, 0x0CFE3F26U})
      controller.hear({id | kExtendedId, 8, {flow, 0xFF, state, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}}, Time{1s});
    controller.step(Time{1s}, {});
    EXPECT_TRUE(controller.pilot());
    return controller.spool_demand();
  };
  EXPECT_TRUE(demand(100, 0x31).isApprox(JointVector(0.4, -0.4, 0.4), 1e-9)) << "the arm's the other way round";
  EXPECT_TRUE(demand(100, 0x32).isApprox(JointVector(-0.5, 0.4 / 0.9, -0.4), 1e-9));
  for (const int state : {0x30, 0x33, 0x34, 0x3F})
    EXPECT_EQ(demand(200, static_cast<std::uint8_t>(state)), JointVector::Zero()) << state;
  EXPECT_EQ(demand(0, 0x31), JointVector::Zero());
}

}  // namespace
}  // namespace knuckle::sim
