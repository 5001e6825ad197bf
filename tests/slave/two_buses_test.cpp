// A machine with its valves or its commands on one bus and what it sends by itself on another: whatever becomes of
// either, it is neutral in time, and the reason names the bus.
#include "tests/support/two_buses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>

#include "machine/reason_text.h"
#include "machine/set_points.h"
#include "slave/bus_map.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/command_machine.h"

namespace knuckle::slave {
namespace {

struct Machine {
  const char* name;
  std::string (*text)();
};
const std::array<Machine, 2> kMachines{{
    {"nodes", test::two_buses_text},
    {"commands", [] { return test::on_two_buses(test::command_text()); }},
}};

struct TwoBuses : test::BenchMachine {
  explicit TwoBuses(const Machine& machine) : BenchMachine(calibrated(parse_machine(machine.text(), "m.toml"))) {
    signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
  }
  [[nodiscard]] VirtualCanBus& on(std::size_t which) { return which == 0 ? bus : second; }
  [[nodiscard]] std::string fault() const { return text_with_code(loop.fault(), description.bus); }
  [[nodiscard]] bool closed() const {
    return (signals.spool.array().abs() < description.cylinders[kBoom].valve.dead_band_extend).all();
  }
  /// Engaged, and moving.
  [[nodiscard]] bool led() {
    if (!engage()) return false;
    move(JointVector(0.2, -0.2, -0.25), 500ms);
    return loop.mode() == Mode::kEngaged && !closed();
  }
};

struct BusFault {
  const char* name;
  const char* code;
  void (*set)(VirtualCanBus& bus, bool broken);
};
const std::array<BusFault, 3> kFaults{{
    {"cut", "bus_passive", [](VirtualCanBus& bus, bool on) { bus.disconnect(0, on); }},
    {"bus-off", "bus_off", [](VirtualCanBus& bus, bool on) { on ? bus.bus_off(0) : bus.recover(0); }},
    {"down", "bus_down", [](VirtualCanBus& bus, bool on) { bus.take_down(0, on); }},
}};
// Until commands are neutral on the wire that still works, and until spools are closed by these or by watchdogs.
constexpr Duration kNeutral = 100ms, kClosed = 250ms;

TEST(TwoBuses, EitherCutOrOffIsNeutralInTimeAndNamed) {
  for (const Machine& machine : kMachines) {
    for (const BusFault& fault : kFaults) {
      for (const std::size_t which : {0U, 1U}) {
        TwoBuses m(machine);
        SCOPED_TRACE(std::string(machine.name) + ", " + fault.name + ", " + std::to_string(which));
        ASSERT_TRUE(m.led()) << m.fault();
        fault.set(m.on(which), true);
        m.run(10ms);
        const std::string expected = std::string(fault.code) + ": bus " + (which == 0 ? "valves" : "machine") + ": ";
        EXPECT_EQ(m.fault().rfind(expected, 0), 0U) << m.fault();
        EXPECT_EQ(m.loop.mode(), Mode::kFault);
        m.run(kNeutral - 10ms);
        EXPECT_EQ(m.loop.commands(), JointVector::Zero());
        m.run(kClosed - kNeutral);
        EXPECT_TRUE(m.closed());
        // Mended: it waits until the operator lets go, and takes over anew.
        fault.set(m.on(which), false);
        m.run(500ms);
        EXPECT_TRUE(m.closed());
        EXPECT_EQ(m.loop.mode(), Mode::kFault) << "enable is still held";
        EXPECT_TRUE(m.engage() || m.engage()) << m.fault();  // a bus-off is acknowledged by the first
      }
    }
  }
}

TEST(TwoBuses, WhatTheWireThatWorksSaysIsNeutralAtOnce) {
  TwoBuses m(kMachines[0]);
  ASSERT_TRUE(m.led()) << m.fault();
  m.wire.clear();
  const Time broken = m.now;
  m.second.bus_off(0);
  m.run(300ms);
  for (int joint = 0; joint < kJoints; ++joint) {
    const Time neutral = m.command_neutral_since(broken, joint);
    ASSERT_NE(neutral, kNever);
    EXPECT_LE(to_seconds(neutral - broken), 0.015);
  }
}

/// Frames of the highest priority, more than fit.
void flood(VirtualCanBus& bus, int frames_per_ms) {
  for (int i = 0; i < frames_per_ms; ++i) bus.port(2).send({.id = 0x001, .size = 8, .data = {}});
}

TEST(TwoBuses, BothFloodedAreNeutralInTimeAndTheSignalsBusIsNamed) {
  for (const Machine& machine : kMachines) {
    TwoBuses m(machine);
    SCOPED_TRACE(machine.name);
    ASSERT_TRUE(m.led()) << m.fault();
    const double limit_s = m.description.bus.sensor_age_limit_s;
    Time stopped = kNever;
    const Time from = m.now;
    for (int i = 0; i < 400; ++i) {
      flood(m.bus, 5);
      flood(m.second, 3);
      m.move(JointVector(0.2, -0.2, -0.25), 1ms);
      if (stopped == kNever && m.loop.mode() == Mode::kFault) stopped = m.now;
      EXPECT_TRUE(m.closed() || to_seconds(m.now - from) <= limit_s + 0.2) << to_seconds(m.now - from);
    }
    ASSERT_NE(stopped, kNever);
    EXPECT_LE(to_seconds(stopped - from), limit_s + 0.02);
    EXPECT_NE(m.fault().find(", bus "), std::string::npos) << m.fault();
  }
}

TEST(TwoBuses, AFloodOfStrangersOnBothThatLeavesRoomIsNoFault) {
  TwoBuses m(kMachines[0]);
  ASSERT_TRUE(m.led()) << m.fault();
  for (int i = 0; i < 1000; ++i) {
    if (i % 2 == 0) flood(m.bus, 1);
    if (i % 4 == 0) flood(m.second, 1);
    m.move(JointVector(0.02, -0.02, -0.02), 1ms);
  }
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
}

TEST(TwoBuses, WhatStopsComingOnTheSecondIsNamedWithIt) {
  TwoBuses m(kMachines[0]);
  ASSERT_TRUE(m.led()) << m.fault();
  m.can.lost = {0x18FF2021U | kExtendedId | kSecondBus};
  m.run(100ms);
  EXPECT_EQ(m.fault().rfind("sensor_stale: pressure_1 (0x18FF2021, bus machine), boom_head_pressure: ", 0), 0U)
      << m.fault();
}

/// The slope's frame and the boom valve's status have the same identifier, each on its bus.
TEST(TwoBuses, EqualIdentifiersAreHeldApart) {
  TwoBuses m(kMachines[0]);
  EXPECT_TRUE(m.led()) << m.fault();
  const std::vector<CanFilter> first = heard_by_controller(m.description.bus.alone(0)),
                               second = heard_by_controller(m.description.bus.alone(1));
  EXPECT_EQ(std::count(first.begin(), first.end(), CanFilter(0x190)), 1);
  EXPECT_EQ(second, (std::vector<CanFilter>{0x18FF1021U | kExtendedId, 0x18FF2021U | kExtendedId, 0x190U}));
}

TEST(TwoBuses, AnotherSenderOfACommandIsAFaultOnItsBusAlone) {
  TwoBuses m(kMachines[1]);
  ASSERT_TRUE(m.led()) << m.fault();
  const CanFrame foreign{.id = m.description.bus.commands.front().id, .size = 8, .data = {}};
  m.second.port(2).send(foreign);
  m.run(20ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
  m.bus.port(2).send(foreign);
  m.run(20ms);
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kOtherController) << m.fault();
}

}  // namespace
}  // namespace knuckle::slave
