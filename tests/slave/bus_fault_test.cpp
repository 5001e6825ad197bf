// What the machine's side does when a bus itself fails: off, down, or nobody there to acknowledge; where the machine
// has one, and where its valves or its commands are on one bus and what it sends by itself is on another.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>

#include "slave/bus_map.h"
#include "tests/slave/leading.h"
#include "tests/support/command_machine.h"
#include "tests/support/says.h"
#include "tests/support/two_buses.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::LedMachine;

constexpr double kOpen = 0.11;  // of spool stroke: below it no oil flows

struct BusFault {
  ReasonCode reason;
  void (*set)(VirtualCanBus& bus, bool broken);
};
void set_off(VirtualCanBus& bus, bool broken) {
  if (broken)
    bus.bus_off(0);
  else
    bus.recover(0);
}
void take_down(VirtualCanBus& bus, bool broken) {
  bus.take_down(0, broken);
}
const std::array<BusFault, 4> kBusFaults{{
    {ReasonCode::kBusOff, set_off},
    {ReasonCode::kBusDown, take_down},
    {ReasonCode::kBusPassive, [](VirtualCanBus& bus, bool broken) { bus.cut(broken); }},  // nobody acknowledges
    {ReasonCode::kBusPassive, [](VirtualCanBus& bus, bool broken) { bus.disconnect(0, broken); }},
}};

bool commands_motion(const CanFrame& frame) {
  const bool to_valve = frame.id >= 0x210 && frame.id <= 0x212;
  return to_valve && canopen::parse_valve_command(frame)->set_point != 0;
}

/// Enable as the operator's hand does it.
void set_enable(BenchMachine& m, bool pressed, Duration held) {
  m.hand.enable = pressed;
  m.align();
  m.run(held);
}

TEST(BusFault, EndsInNeutralNamesItselfAndWaitsForTheOperator) {
  for (const BusFault& fault : kBusFaults) {
    SCOPED_TRACE(name(fault.reason));
    LedMachine m;
    fault.set(m.bus, true);
    m.run(10ms);
    EXPECT_TRUE(m.faulted(fault.reason));
    m.run(310ms);  // nothing reaches the valves: they and the enable node end the motion by themselves
    EXPECT_LT(m.signals.spool.cwiseAbs().maxCoeff(), kOpen);
    EXPECT_FALSE(m.nodes.outputs().pilot);

    fault.set(m.bus, false);
    double opened = 0;
    for (int i = 0; i < 3000; ++i) {
      m.tick();
      opened = std::max(opened, m.signals.spool.cwiseAbs().maxCoeff());
    }
    EXPECT_LT(opened, kOpen) << "what waited in the queue must move nothing";
    EXPECT_EQ(m.loop.mode(), Mode::kFault) << "enable is still held";
    m.wire.clear();
    set_enable(m, false, 100ms);
    set_enable(m, true, 100ms);
    set_enable(m, false, 4s);
    EXPECT_TRUE(std::none_of(m.wire.begin(), m.wire.end(), [](const auto& w) { return commands_motion(w.frame); }));
    set_enable(m, true, 0ms);
    EXPECT_TRUE(m.reaches(Mode::kEngaged, 1s)) << text(m.loop.blocking());
  }
}

TEST(BusFault, AnEStopThatWasOpenBeforeDoesNotHideTheQuestionAfterABusOff) {
  LedMachine m;
  m.nodes.set_estop(true);
  m.run(200ms);
  ASSERT_EQ(m.loop.mode(), Mode::kEStop);
  m.bus.bus_off(0);
  set_enable(m, false, 2s);
  m.nodes.set_estop(false);
  m.bus.recover(0);
  m.wire.clear();
  m.run(1s);  // let go of, but nobody has asked to go on
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kBusOff));
  EXPECT_TRUE(m.frames(0x080).empty()) << "the nodes must see that nobody leads them";
  EXPECT_TRUE(m.frames(0x701).empty());
  set_enable(m, true, 100ms);
  set_enable(m, false, 4s);
  set_enable(m, true, 0ms);
  EXPECT_TRUE(m.reaches(Mode::kEngaged, 1s)) << text(m.loop.blocking());
}

TEST(BusFault, StartedWithoutAnybodyOnTheBusItSaysSoAndGoesOnOnceTheyAreThere) {
  BenchMachine m;
  m.bus.cut(true);
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kBusPassive));
  m.bus.cut(false);
  m.run(4s);
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

// Of two buses: whatever becomes of either, the machine is neutral in time, and the reason names the bus.

struct Machine {
  const char* name;
  std::string (*text)();
};
const std::array<Machine, 2> kMachines{{
    {"nodes", test::two_buses_text},
    {"commands", [] { return test::on_two_buses(test::command_text()); }},
}};

struct TwoBuses : test::BenchMachine {
  explicit TwoBuses(const Machine& machine) : BenchMachine(parse_machine(machine.text(), "m.toml")) {}
  [[nodiscard]] VirtualCanBus& on(std::size_t which) { return which == 0 ? bus : second; }
  /// Engaged, and moving.
  [[nodiscard]] bool led() {
    if (!engage()) return false;
    move(JointVector(0.2, -0.2, -0.25), 500ms);
    return loop.mode() == Mode::kEngaged && !closed();
  }
};

// Until commands are neutral on the wire that still works, and until spools are closed by these or by watchdogs.
constexpr Duration kNeutral = 100ms, kClosed = 250ms;

TEST(TwoBuses, EitherCutOrOffIsNeutralInTimeAndNamed) {
  for (const Machine& machine : kMachines) {
    for (const BusFault& fault : kBusFaults) {
      for (const std::size_t which : {0U, 1U}) {
        TwoBuses m(machine);
        SCOPED_TRACE(std::string(machine.name) + ", " + name(fault.reason) + ", " + std::to_string(which));
        ASSERT_TRUE(m.led()) << m.fault();
        fault.set(m.on(which), true);
        m.run(10ms);
        const std::string expected =
            std::string(name(fault.reason)) + ": bus " + (which == 0 ? "valves" : "machine") + ": ";
        EXPECT_TRUE(test::begins(m.fault(), expected));
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
    EXPECT_TRUE(test::says(m.fault(), ", bus "));
  }
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
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kOtherController));
}

}  // namespace
}  // namespace knuckle::slave
