// Two buses as one: who sends where, whose a frame is, and what is known of each.
#include "transport/can_buses.h"

#include <gtest/gtest.h>

#include <array>

#include "transport/virtual_can.h"

namespace knuckle {
namespace {

constexpr std::uint32_t kId = 0x190;

struct Two {
  VirtualCanBus first{2, 500000}, second{2, 250000};
  CanBuses both{first.port(0), &second.port(0)};
  Time now{};
  void pass() {
    now += 10ms;
    first.advance(now);
    second.advance(now);
  }
};

TEST(CanBuses, EqualIdentifiersOnBothAreTwo) {
  Two two;
  EXPECT_TRUE(two.both.send({.id = kId, .size = 1, .data = {1}}));
  EXPECT_TRUE(two.both.send({.id = kId | kSecondBus, .size = 1, .data = {2}}));
  two.pass();
  CanFrame frame;
  ASSERT_TRUE(two.first.port(1).receive(frame));
  EXPECT_EQ(frame, (CanFrame{.id = kId, .size = 1, .data = {1}}));
  ASSERT_TRUE(two.second.port(1).receive(frame));
  EXPECT_EQ(frame, (CanFrame{.id = kId, .size = 1, .data = {2}})) << "on the wire nobody sees the mark";
  EXPECT_FALSE(two.first.port(1).receive(frame));
  two.first.port(1).send({.id = kId, .size = 1, .data = {3}});
  two.second.port(1).send({.id = kId | kExtendedId, .size = 1, .data = {4}});
  two.pass();
  ASSERT_TRUE(two.both.receive(frame));
  EXPECT_EQ(frame.id, kId);
  ASSERT_TRUE(two.both.receive(frame));
  EXPECT_EQ(frame.id, kId | kExtendedId | kSecondBus);
  EXPECT_FALSE(two.both.receive(frame));
}

TEST(CanBuses, AFloodOfOneLeavesTheOthersFramesTheirShare) {
  Two two;
  for (int i = 0; i < 60; ++i) two.first.port(1).send({.id = 1});
  for (int i = 0; i < 3; ++i) two.second.port(1).send({.id = 2});
  two.pass();
  int of_second = 0;
  CanFrame frame;
  for (int i = 0; i < 6 && two.both.receive(frame); ++i) of_second += frame.id == (2 | kSecondBus) ? 1 : 0;
  EXPECT_EQ(of_second, 3);
}

TEST(CanBuses, TheWorseStateCountsAndWhoseItIs) {
  Two two;
  EXPECT_EQ(two.both.state(), CanState::kActive);
  two.second.disturb(0, true);
  EXPECT_EQ(two.both.state(), CanState::kPassive);
  EXPECT_EQ(two.both.state_of(), 1);
  two.first.bus_off(0);
  const OneOfBuses first(two.both, 0), second(two.both, 1);
  EXPECT_EQ(first.state(), CanState::kBusOff);
  EXPECT_EQ(second.state(), CanState::kPassive);
  EXPECT_EQ(two.both.state(), CanState::kBusOff);
  EXPECT_EQ(two.both.state_of(), 0);
  EXPECT_EQ(two.both.states(), (std::array{CanState::kBusOff, CanState::kPassive}));
  EXPECT_FALSE(two.both.send({.id = kId}));
  EXPECT_TRUE(two.both.send({.id = kId | kSecondBus})) << "the other goes on";
  two.first.recover(0);
  EXPECT_EQ(two.both.state(), CanState::kBusOff) << "not acknowledged";
  two.both.acknowledge();
  EXPECT_EQ(two.both.state(), CanState::kPassive);
  EXPECT_EQ(two.both.state_of(), 1);
}

TEST(CanBuses, OneIsItselfAndHasNoSecond) {
  VirtualCanBus bus(2, 500000);
  CanBuses one(bus.port(0));
  EXPECT_TRUE(one.send({.id = kId}));
  EXPECT_FALSE(one.send({.id = kId | kSecondBus}));
  bus.port(1).send({.id = 5});
  bus.advance(Time{10ms});
  CanFrame frame;
  ASSERT_TRUE(one.receive(frame));
  EXPECT_EQ(frame.id, 5U);
  EXPECT_FALSE(one.receive(frame));
  bus.bus_off(0);
  EXPECT_EQ(one.state(), CanState::kBusOff);
  EXPECT_EQ(one.state_of(), 0);
  EXPECT_EQ(one.states(), (std::array{CanState::kBusOff, CanState::kActive}));
}

}  // namespace
}  // namespace knuckle
