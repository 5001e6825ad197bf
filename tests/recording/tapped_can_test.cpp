#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "recording/replayed_wires.h"
#include "recording/tapped_wires.h"
#include "transport/can_buses.h"
#include "transport/virtual_can.h"

namespace knuckle::recording {
namespace {

constexpr std::uint32_t kBitRate = 500'000;

TEST(TappedCan, TellsTheShareOfTimeThatFramesBothWaysTook) {
  VirtualCanBus bus(2, kBitRate);
  LoopTap off;
  TappedCan can(bus.port(0), off);
  EXPECT_EQ(can.meter().take_loads(Time(1s), kBitRate)[0], 0) << "there was no time yet";
  const CanFrame out{.id = 0x555, .size = 0}, in{.id = 0x2AA, .size = 8, .data = {0x55, 0xAA, 0x55, 0xAA, 0x55}};
  double bits = 0;
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(can.send(out));
    bus.port(1).send(in);
    bus.advance(Time(1s + i * 1ms + 1ms));
    CanFrame heard;
    ASSERT_TRUE(can.receive(heard));
    EXPECT_FALSE(can.receive(heard));
    bits += frame_bits(out) + frame_bits(in);
  }
  EXPECT_DOUBLE_EQ(can.meter().take_loads(Time(1050ms), kBitRate)[0], bits / (0.050 * kBitRate));
  EXPECT_GT(bits / (0.050 * kBitRate), 0.2);
  EXPECT_EQ(can.meter().take_loads(Time(1100ms), kBitRate)[0], 0) << "nothing since";
  EXPECT_EQ(can.meter().take_loads(Time(1100ms), kBitRate)[0], 0) << "no time since";
  bus.take_down(0, true);
  EXPECT_FALSE(can.send(out));
  EXPECT_EQ(can.state(), CanState::kDown);
  EXPECT_EQ(can.meter().take_loads(Time(1200ms), kBitRate)[0], 0) << "it did not go out";
}

TEST(TappedCan, OfTwoBusesLogsWhatPassedMetersEachAndRecordsTheStateOfEach) {
  VirtualCanBus first(2, kBitRate), second(2, kBitRate / 2);
  CanBuses both(first.port(0), &second.port(0));
  LoopTap off;
  TappedCan can(both, off), only_metered(first.port(1), off);
  can.keep_copies();
  can.stamp(Time(1s));
  (void)can.meter().take_loads(Time(1s), kBitRate, kBitRate / 2);
  const CanFrame frame{.id = 0x18FF0105U | kExtendedId | kSecondBus, .size = 1, .data = {0xAB}};
  ASSERT_TRUE(can.send(frame));
  ASSERT_TRUE(can.send({.id = 0x080}));
  const std::array<double, 2> loads = can.meter().take_loads(Time(1100ms), kBitRate, kBitRate / 2);
  EXPECT_DOUBLE_EQ(loads[0], frame_bits({.id = 0x080}) / (0.1 * kBitRate));
  EXPECT_DOUBLE_EQ(loads[1], frame_bits(frame) / (0.1 * kBitRate / 2));
  ASSERT_TRUE(only_metered.send({.id = 0x185, .size = 2, .data = {0x00, 0x11}}));
  first.advance(Time(1101ms));
  can.stamp(Time(1105ms));
  CanFrame heard;
  ASSERT_TRUE(can.receive(heard));
  std::ostringstream log, nothing;
  can.write(log, "can0", "can3");
  EXPECT_EQ(log.str(),
            "(0000000001.000000) can3 18FF0105#AB\n(0000000001.000000) can0 080#\n"
            "(0000000001.105000) can0 185#0011\n");
  can.write(nothing, "can0", "can3");
  only_metered.write(nothing, "can0");
  EXPECT_EQ(nothing.str(), "") << "once, and only where copies are kept";
  second.disturb(0, true);
  EXPECT_EQ(can.state(), CanState::kPassive);
  EXPECT_EQ(can.state_of(), 1);
}

TEST(ReplayedCan, SaysOfWhichOfTwoBusesAFrameAndAStateAre) {
  const std::array<std::uint8_t, 1> data{0x42};
  StepWires step;
  step.events = {{WireEventKind::kCanReceived, 0x190U | kSecondBus, data},
                 {WireEventKind::kCanState, 1U | 1U << kStateOfBit, {}},
                 {WireEventKind::kCanState, 2, {}},
                 {WireEventKind::kCanState, can_states_value({CanState::kPassive, CanState::kDown}), {}}};
  ReplayedWires wires;
  wires.begin(step);
  CanFrame frame;
  ASSERT_TRUE(wires.can().receive(frame));
  EXPECT_EQ(frame, (CanFrame{.id = 0x190U | kSecondBus, .size = 1, .data = {0x42}}));
  EXPECT_EQ(wires.can().state(), CanState::kPassive);
  EXPECT_EQ(wires.can().state_of(), 1);
  EXPECT_EQ(wires.can().state(), CanState::kBusOff) << "as recordings of one bus have it";
  EXPECT_EQ(wires.can().state_of(), 0);
  EXPECT_EQ(wires.can().states(), (std::array{CanState::kBusOff, CanState::kActive}));
  EXPECT_EQ(wires.can().state(), CanState::kDown);
  EXPECT_EQ(wires.can().states(), (std::array{CanState::kPassive, CanState::kDown}));
}

TEST(CanStates, OfTwoBusesAreOneNumberAndBackAndWhatIsNoneIsDown) {
  for (const unsigned first : {0U, 1U, 2U, 3U}) {
    for (const unsigned second : {0U, 1U, 2U, 3U}) {
      const std::array states{static_cast<CanState>(first), static_cast<CanState>(second)};
      EXPECT_EQ(can_states(can_states_value(states)), states);
      EXPECT_EQ(can_state(can_states_value(states)), std::max(states[0], states[1]));
      EXPECT_TRUE(both_told(can_states_value(states)));
    }
  }
  for (const std::uint32_t damaged : {0xFFU, 0x04U, 0xFFFFFFFFU}) {
    EXPECT_EQ(can_state(damaged), CanState::kDown) << damaged;
    for (const CanState state : can_states(damaged)) EXPECT_LE(state, CanState::kDown) << damaged;
  }
}

TEST(TappedCan, CountsTheFramesThatItHasNoRoomToCopyAndStillPassesThem) {
  VirtualCanBus bus(2, kBitRate);
  LoopTap off;
  TappedCan can(bus.port(0), off);
  can.keep_copies();
  bus.silence(0, true);  // its controller believes that all of them were sent
  const auto send_all = [&can](int frames) {
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(can.send({.id = 1}));
  };
  send_all(8192);
  EXPECT_EQ(can.lost(), 0U);
  send_all(3);
  EXPECT_EQ(can.lost(), 3U);
}

}  // namespace
}  // namespace knuckle::recording
