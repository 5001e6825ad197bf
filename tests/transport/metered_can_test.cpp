#include "transport/metered_can.h"

#include <gtest/gtest.h>

#include "transport/thread_wires.h"
#include "transport/virtual_can.h"

namespace knuckle {
namespace {

constexpr std::uint32_t kBitRate = 500'000;

TEST(MeteredCan, TellsTheShareOfTimeThatFramesBothWaysTook) {
  VirtualCanBus bus(2, kBitRate);
  MeteredCan can(bus.port(0), kBitRate);
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

TEST(MeteredCan, DoesNotCountWhatDidNotGoOut) {
  VirtualCanBus bus(2, kBitRate);
  MeteredCan can(bus.port(0), kBitRate);
  (void)can.take_load(Time(0s));
  bus.take_down(0, true);
  EXPECT_FALSE(can.send({.id = 1}));
  EXPECT_EQ(can.state(), CanState::kDown);
  EXPECT_EQ(can.take_load(Time(1s)), 0);
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
