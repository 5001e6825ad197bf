// What the machine's side does when the bus itself fails: off, down, or nobody there to acknowledge.
#include <gtest/gtest.h>

#include "tests/slave/leading.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::lead;

constexpr double kOpen = 0.11;  // of spool stroke: below it no oil flows

struct BusFault {
  const char* name;
  ReasonCode reason;
  void (*set)(VirtualCanBus& bus, bool broken);
};

const std::array<BusFault, 3> kBusFaults{{
    {"bus_off", ReasonCode::kBusOff,
     [](VirtualCanBus& bus, bool on) {
       if (on)
         bus.bus_off(0);
       else
         bus.recover(0);
     }},
    {"down", ReasonCode::kBusDown, [](VirtualCanBus& bus, bool on) { bus.take_down(0, on); }},
    {"nobody acknowledges", ReasonCode::kBusPassive, [](VirtualCanBus& bus, bool on) { bus.cut(on); }},
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
    SCOPED_TRACE(fault.name);
    BenchMachine m;
    lead(m);
    fault.set(m.bus, true);
    m.run(10ms);
    EXPECT_EQ(m.loop.mode(), Mode::kFault);
    EXPECT_EQ(m.loop.fault().code, fault.reason) << text(m.loop.fault());
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

TEST(BusFault, BusOffIsNotForgottenBecauseTheControllerWasRestarted) {
  BenchMachine m;
  lead(m);
  m.bus.bus_off(0);
  m.run(50ms);
  m.bus.recover(0);
  m.wire.clear();
  set_enable(m, false, 5s);  // let go of, but nobody has asked to go on
  EXPECT_EQ(m.loop.blocking().code, ReasonCode::kBusOff) << text(m.loop.blocking());
  EXPECT_TRUE(m.frames(0x080).empty()) << "the nodes must see that nobody leads them";
  EXPECT_TRUE(m.frames(0x701).empty());
}

TEST(BusFault, AnEStopThatWasOpenBeforeDoesNotHideTheQuestionAfterABusOff) {
  BenchMachine m;
  lead(m);
  m.nodes.set_estop(true);
  m.run(200ms);
  ASSERT_EQ(m.loop.mode(), Mode::kEStop);
  m.bus.bus_off(0);
  set_enable(m, false, 2s);
  m.nodes.set_estop(false);
  m.bus.recover(0);
  m.run(100ms);
  EXPECT_EQ(m.loop.blocking().code, ReasonCode::kBusOff) << text(m.loop.blocking());
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
  EXPECT_EQ(m.loop.blocking().code, ReasonCode::kBusPassive) << text(m.loop.blocking());
  m.bus.cut(false);
  m.run(4s);
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

}  // namespace
}  // namespace knuckle::slave
