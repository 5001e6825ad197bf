// Frames that tell the machine's own controller what to do: what is in them, when they go out, and that all that is not
// asked for rests. Decoded bit by bit, without the program's codec.
#include "slave/command_frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "machine/set_points.h"
#include "tests/slave/kept_bus.h"
#include "tests/slave/passed.h"
#include "tests/support/command_machine.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/module_machine.h"

namespace knuckle::slave {
namespace {

constexpr std::uint32_t kFront = 0x18FF0105U | kExtendedId, kSetting = 0x1A6, kPilot = 0x18FF0305U | kExtendedId;

/// Bits from the first, least significant first.
std::uint64_t intel(const CanFrame& frame, unsigned start, unsigned bits) {
  std::uint64_t raw = 0;
  for (unsigned i = 0; i < bits; ++i) raw |= std::uint64_t(frame.data[(start + i) / 8] >> (start + i) % 8 & 1) << i;
  return raw;
}

std::uint8_t h2f(const CanFrame& frame) {
  unsigned crc = 0xFF;
  const auto add = [&](unsigned byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80) != 0 ? (crc << 1 ^ 0x2F) & 0xFF : crc << 1;
  };
  for (int i = 0; i < 7; ++i) add(frame.data[static_cast<std::size_t>(i)]);
  add(0x21);
  return static_cast<std::uint8_t>(crc ^ 0xFF);
}

struct Told {
  explicit Told(const char* commands = test::kRateCommands) : machine(test::command_machine(commands)) {}
  explicit Told(MachineDescription of) : machine(std::move(of)) {}
  [[nodiscard]] PassedCommands passed(int joint, double value) const { return passed_now(machine, joint, value, now); }
  void step(const PassedCommands& commands, bool led) {
    frames.step(commands, led, bus, now);
    now += 5ms;
  }
  MachineDescription machine;
  test::KeptBus bus;
  CommandFrames frames{machine.bus};
  Time now{1s};
};

TEST(CommandFrames, SayTheJointsSpeedsAndRestElsewhere) {
  Told told;
  told.step(told.passed(kArm, 0.3), true);
  const CanFrame front = told.bus.frames(kFront).at(0), setting = told.bus.frames(kSetting).at(0);
  EXPECT_EQ(front.size, 8);
  EXPECT_EQ(intel(front, 0, 16), 32000U) << "boom at 0";
  EXPECT_EQ(intel(front, 16, 16), 31460U) << "0.3 of -0.9 rad/s";
  EXPECT_EQ(front.data[4] << 8 | front.data[5], 0) << "bucket at 0";
  EXPECT_EQ(intel(front, 48, 16), 32000U) << "slew";
  EXPECT_EQ(intel(setting, 8, 4), 2U) << "led";
  EXPECT_EQ(intel(setting, 16, 2), 3U) << "horn";
  EXPECT_EQ(setting.data[7], h2f(setting));
  EXPECT_EQ(told.frames.demand(), JointVector(0, 0.3, 0));
}

TEST(CommandFrames, ComeByTheirPeriodsAndCount) {
  Told told;
  for (int i = 0; i < 200; ++i) told.step({}, false);
  EXPECT_EQ(told.bus.frames(kFront).size(), 100U);
  const std::vector<CanFrame> settings = told.bus.frames(kSetting);
  ASSERT_EQ(settings.size(), 50U);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    EXPECT_EQ(intel(settings[i], 48, 4), i % 15) << i;
    EXPECT_EQ(intel(settings[i], 8, 4), 1U) << "nobody leads";
    EXPECT_EQ(settings[i].data[7], h2f(settings[i])) << i;
  }
}

TEST(CommandFrames, AStopDoesNotWaitForThePeriod) {
  Told told;
  told.step(told.passed(kBoom, -0.3), true);
  ASSERT_NE(intel(told.bus.frames(kFront).back(), 0, 16), 32000U);
  told.bus.sent.clear();
  told.step({}, true);
  ASSERT_EQ(told.bus.frames(kFront).size(), 1U) << "5 ms after the last";
  EXPECT_EQ(intel(told.bus.frames(kFront)[0], 0, 16), 32000U);
  EXPECT_EQ(told.bus.frames(kSetting).size(), 0U) << "which says nothing of joints";
  told.bus.sent.clear();
  told.step({}, false);
  ASSERT_EQ(told.bus.frames(kSetting).size(), 1U) << "the operator has let go";
  EXPECT_EQ(intel(told.bus.frames(kSetting)[0], 8, 4), 1U);
}

TEST(CommandFrames, AStopThatTheBusDidNotTakeIsSentAgain) {
  Told told;
  told.step(told.passed(kBoom, 0.3), true);
  told.bus.full = true;
  told.step({}, false);
  EXPECT_NE(told.frames.demand()[kBoom], 0) << "nobody has been told";
  told.bus.full = false;
  told.bus.sent.clear();
  told.step({}, false);
  ASSERT_EQ(told.bus.frames(kFront).size(), 1U);
  EXPECT_EQ(told.frames.demand(), JointVector::Zero());
}

/// Without its J1939 address Knuckle may not speak from it; all else goes to neutral as ever.
TEST(CommandFrames, OnlyThoseFromALostAddressAreSilent) {
  const MachineDescription machine = test::commanded_j1939_machine();
  ASSERT_NE(machine.bus.commands[0].mask, CanFilter::kWhole);
  CommandFrames frames(machine.bus);
  test::KeptBus bus;
  frames.step(PassedCommands(), false, bus, Time{1s}, false);
  ASSERT_EQ(bus.sent.size(), 1U);
  EXPECT_EQ(bus.sent[0].id, machine.bus.commands[1].id);
}

TEST(CommandFrames, TakingOverIsToldAtOnce) {
  Told told;
  told.step({}, false);
  told.bus.sent.clear();
  told.step({}, true);
  ASSERT_EQ(told.bus.frames(kSetting).size(), 1U) << "5 ms after the last";
  EXPECT_EQ(intel(told.bus.frames(kSetting)[0], 8, 4), 2U);
}

TEST(CommandFrames, GoOnCountingWhereAnotherEnded) {
  Told told;
  for (int i = 0; i < 5; ++i) told.step({}, false);
  const std::uint64_t last = intel(told.bus.frames(kSetting).back(), 48, 4);
  CommandFrames next(told.machine.bus);
  next.go_on_from(told.frames);
  told.bus.sent.clear();
  next.step({}, false, told.bus, told.now);
  EXPECT_EQ(intel(told.bus.frames(kSetting).at(0), 48, 4), last + 1);
}

TEST(CommandFrames, OfALedMachineAloneEndWithNeutral) {
  Told told(test::kPilotCommands);
  for (int i = 0; i < 20; ++i) told.step({}, false);
  ASSERT_EQ(told.bus.frames(kPilot).size(), 1U) << "once: whatever was told before is over";
  for (int i = 0; i < 20; ++i) told.step(told.passed(kBucket, -0.35), true);
  const std::vector<CanFrame> led = told.bus.frames(kPilot);
  EXPECT_EQ(led.size(), 11U);
  EXPECT_EQ(led.back().data, (std::array<std::uint8_t, 8>{0, 0, 0, 0, 0, 70, 0, 0})) << "0.35 of 40 bar";
  told.bus.sent.clear();
  for (int i = 0; i < 20; ++i) told.step({}, false);
  const std::vector<CanFrame> rest = told.bus.frames(kPilot);
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].data, (std::array<std::uint8_t, 8>{}));
}

/// What a command of an auxiliary valve says, by ISO 11783-7.
struct AuxValve {
  explicit AuxValve(const CanFrame& frame)
      : flow(0.004 * frame.data[0]), state(frame.data[2] & 0xF), fail_safe(frame.data[2] >> 6) {
    reserved = frame.size == 8 && frame.data[1] == 0xFF && (frame.data[2] >> 4 & 3) == 3 &&
               std::all_of(frame.data.begin() + 3, frame.data.end(), [](int byte) { return byte == 0xFF; });
  }
  double flow;
  int state, fail_safe;
  bool reserved;
};
constexpr std::uint32_t kAuxBoom = 0x0CFE3326U | kExtendedId, kAuxArm = 0x0CFE3026U | kExtendedId,
                        kAuxBucket = 0x0CFE3F26U | kExtendedId;

TEST(CommandFrames, OfAuxiliaryValvesSayHowMuchFlowAndWhichWay) {
  Told told(test::valves_machine());
  told.step(told.passed(kArm, 0.3), true);
  const CanFrame arm = told.bus.frames(kAuxArm).at(0), boom = told.bus.frames(kAuxBoom).at(0);
  EXPECT_EQ(arm.data, (std::array<std::uint8_t, 8>{67, 0xFF, 0x32, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}))
      << "0.3 of 90 %, towards neutral; mounted the other way round";
  EXPECT_EQ(boom.data, (std::array<std::uint8_t, 8>{0, 0xFF, 0x30, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF})) << "blocked";
  told.now += 50ms;
  told.step(told.passed(kBoom, -0.3), true);
  EXPECT_EQ(told.bus.frames(kAuxBoom).back().data[0], 60) << "0.3 of 80 %";
  EXPECT_EQ(told.bus.frames(kAuxBoom).back().data[2], 0x32);
  EXPECT_EQ(told.bus.frames(kAuxArm).back().data[2], 0x30);
}

/// What is commanded in a step that is drawn, of one joint at the most.
struct Drawn {
  int step = 0, joint = 0;
  bool led = false;
  double value = 0;
  [[nodiscard]] double of(int other) const {
    if (other != joint) return 0;
    return value;
  }
  /// No more than was asked for, and as exactly as its bits can say it.
  void expect_said(int other, double said, double exactly) const {
    ASSERT_NEAR(said, of(other), exactly) << step;
    ASSERT_LE(std::abs(said), std::abs(of(other)) + 1e-9) << step << ": rounded beyond what a gate has capped";
  }
};

/// Seeded: whatever is commanded, from step to step, on a bus that takes it or not.
void draw_commands(Told& told, unsigned seed, const std::function<void(const Drawn&, const CanFrame&)>& judge) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<> value(-0.35, 0.35), hardly(-0.006, 0.006);
  std::bernoulli_distribution coin(0.5), full(0.1);
  for (int i = 0; i < 20000; ++i) {
    Drawn drawn{.step = i, .joint = static_cast<int>(random() % kJoints), .led = coin(random)};
    PassedCommands passed;
    if (drawn.led && coin(random)) drawn.value = (coin(random) ? value : hardly)(random);
    if (drawn.led) passed = told.passed(drawn.joint, drawn.value);
    told.bus.full = full(random);
    told.bus.sent.clear();
    told.step(passed, drawn.led);
    for (const CanFrame& frame : told.bus.sent) ASSERT_NO_FATAL_FAILURE(judge(drawn, frame));
  }
}

/// Blocked, never float, and no way without flow.
TEST(CommandFrames, OfAuxiliaryValvesAreBlockedWhereNoGateLetMorePass) {
  Told told(test::valves_machine());
  int open = 0, rounded = 0;
  draw_commands(told, 11783, [&](const Drawn& drawn, const CanFrame& frame) {
    const int of = frame.id == kAuxBoom ? kBoom : frame.id == kAuxArm ? kArm : kBucket;
    ASSERT_TRUE(of != kBucket || frame.id == kAuxBucket) << std::hex << frame.id;
    const AuxValve valve(frame);
    ASSERT_TRUE(valve.reserved);
    ASSERT_EQ(valve.fail_safe, 0) << "blocked";
    ASSERT_LE(valve.state, 2) << "float, or what is none";
    ASSERT_EQ(valve.flow == 0, valve.state == 0) << drawn.step;
    const bool extends = valve.state == (of == kArm ? 2 : 1);
    const double most = of == kBoom && !extends ? 0.8 : of == kArm && extends ? 0.9 : 1;
    const double said = (extends ? valve.flow : -valve.flow) / most;
    drawn.expect_said(of, said, 0.0051);
    ASSERT_NEAR(set_point_in(frame, of, told.machine.bus).value(), said, 1e-9);
    open += said != 0 ? 1 : 0;
    rounded += drawn.of(of) != 0 && said == 0 ? 1 : 0;
  });
  EXPECT_GT(open, 1000) << "else nothing was tried";
  EXPECT_GT(rounded, 500);
}

/// What is not a joint that a gate has let move rests.
TEST(CommandFrames, WhatNoGateLetPassIsNeutral) {
  Told told;
  draw_commands(told, 60, [](const Drawn& drawn, const CanFrame& frame) {
    if (frame.id == kSetting) {
      ASSERT_EQ(intel(frame, 8, 4), drawn.led ? 2U : 1U);
      ASSERT_EQ(intel(frame, 16, 2), 3U);
      ASSERT_EQ(frame.data[7], h2f(frame));
      return;
    }
    ASSERT_EQ(frame.id, kFront);
    ASSERT_EQ(intel(frame, 48, 16), 32000U);
    const auto bucket = static_cast<std::int16_t>(frame.data[4] << 8 | frame.data[5]);
    const JointVector said((double(intel(frame, 0, 16)) - 32000) * 0.0005 / 0.6,
                           (double(intel(frame, 16, 16)) - 32000) * 0.0005 / -0.9, bucket * 0.1 / -70);
    for (int j = 0; j < kJoints; ++j) {
      drawn.expect_said(j, said[j], 0.0015);
      ASSERT_TRUE(drawn.of(j) != 0 || said[j] == 0) << drawn.step;
    }
  });
}

TEST(CommandFrames, OfAModulesOutputsAreNeutralWhereNoGateLetThemMove) {
  Told told(test::module_machine());
  draw_commands(told, 61, [](const Drawn& drawn, const CanFrame& frame) {
    ASSERT_EQ(frame.id, 0x341U);
    ASSERT_EQ(frame.size, 8);
    const auto volts = [&](std::size_t output) {
      return 1e-3 * static_cast<std::int16_t>(frame.data[2 * output] | frame.data[2 * output + 1] << 8);
    };
    ASSERT_EQ(volts(3), 6);
    for (int j = 0; j < kJoints; ++j) {
      const double at = volts(static_cast<std::size_t>(j));
      drawn.expect_said(j, (at - 6) / (j == kBucket ? -3 : 3), 0.0005);
      ASSERT_TRUE(drawn.of(j) != 0 || at == 6) << drawn.step;
    }
  });
}

}  // namespace
}  // namespace knuckle::slave
