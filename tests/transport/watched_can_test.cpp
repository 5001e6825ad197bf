#include "transport/watched_can.h"

#include <gtest/gtest.h>

#include <sstream>

#include "transport/thread_wires.h"
#include "transport/virtual_can.h"

namespace knuckle {
namespace {

constexpr std::uint32_t kBitRate = 500'000;

TEST(WatchedCan, TellsTheShareOfTimeThatFramesBothWaysTook) {
  VirtualCanBus bus(2, kBitRate);
  WatchedCan can(bus.port(0), kBitRate);
  EXPECT_EQ(can.take_load(Time(1s)), 0) << "there was no time yet";
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
  EXPECT_DOUBLE_EQ(can.take_load(Time(1050ms)), bits / (0.050 * kBitRate));
  EXPECT_GT(bits / (0.050 * kBitRate), 0.2);
  EXPECT_EQ(can.take_load(Time(1100ms)), 0) << "nothing since";
  EXPECT_EQ(can.take_load(Time(1100ms)), 0) << "no time since";
}

TEST(WatchedCan, DoesNotCountWhatDidNotGoOut) {
  VirtualCanBus bus(2, kBitRate);
  WatchedCan can(bus.port(0), kBitRate);
  (void)can.take_load(Time(0s));
  bus.take_down(0, true);
  EXPECT_FALSE(can.send({.id = 1}));
  EXPECT_EQ(can.state(), CanState::kDown);
  EXPECT_EQ(can.take_load(Time(1s)), 0);
}

TEST(WatchedCan, KeepsCopiesOfWhatPassedWithTheTimeOfTheStepWhereAskedTo) {
  VirtualCanBus bus(2, kBitRate);
  WatchedCan can(bus.port(0), kBitRate, true), only_metered(bus.port(1), kBitRate);
  can.stamp(Time(1500ms));
  ASSERT_TRUE(can.send({.id = 0x185, .size = 2, .data = {0x00, 0x11}}));
  ASSERT_TRUE(only_metered.send({.id = 0x080}));
  bus.advance(Time(1501ms));
  can.stamp(Time(1505ms));
  CanFrame heard;
  ASSERT_TRUE(can.receive(heard));
  ASSERT_FALSE(can.receive(heard));
  std::ostringstream log, nothing;
  can.write(log, "vcan7");
  EXPECT_EQ(log.str(), "(0000000001.500000) vcan7 185#0011\n(0000000001.505000) vcan7 080#\n");
  can.write(nothing, "vcan7");
  only_metered.write(nothing, "vcan7");
  EXPECT_EQ(nothing.str(), "");
}

TEST(WatchedCan, CountsTheFramesThatItHasNoRoomToCopyAndStillPassesThem) {
  VirtualCanBus bus(2, kBitRate);
  WatchedCan can(bus.port(0), kBitRate, true);
  bus.silence(0, true);  // its controller believes that all of them were sent
  const auto send_all = [&can](int frames) {
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(can.send({.id = 1}));
  };
  send_all(8192);
  EXPECT_EQ(can.lost(), 0U);
  send_all(3);
  EXPECT_EQ(can.lost(), 3U);
}

TEST(Candump, LineIsThatOfTheTool) {
  const CanFrame f{.id = 0x185, .size = 2, .data = {0x00, 0x11}};
  EXPECT_EQ(candump_line(Time(12s + 345678us + 999ns), f), "(0000000012.345678) can0 185#0011");
  EXPECT_EQ(candump_line(Time{}, {.id = 0x080}, "vcan7"), "(0000000000.000000) vcan7 080#");
  EXPECT_EQ(candump_line(Time(1us), {.id = 0x001, .size = 8, .data = {0xFE}}),
            "(0000000000.000001) can0 001#FE00000000000000");
}

TEST(CanBus, FramesLostAreErrorsOnEitherSideOfAThreadBorder) {
  VirtualCanBus bus(2, kBitRate);
  ThreadCan thread;
  EXPECT_EQ(thread.controller().errors(), 0U);
  for (std::uint32_t n = 0; n < 70; ++n) (void)thread.controller().send({.id = n});
  EXPECT_EQ(thread.controller().errors(), 6U) << "its own queue holds 64";
  for (std::size_t n = 0; n < VirtualCanBus::kSendSlots; ++n) ASSERT_TRUE(bus.port(0).send({.id = 1}));
  thread.exchange(bus.port(0));
  EXPECT_EQ(bus.port(0).errors(), 64U);
  EXPECT_EQ(thread.controller().errors(), 70U) << "the port's queue was full";
}

}  // namespace
}  // namespace knuckle
