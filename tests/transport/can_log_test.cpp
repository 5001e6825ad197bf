// The line of a candump log, and what counts as an error of a bus in another thread.
#include <gtest/gtest.h>

#include "transport/thread_wires.h"
#include "transport/timed_frame.h"
#include "transport/virtual_can.h"

namespace knuckle {
namespace {

TEST(Candump, LineIsThatOfTheTool) {
  const CanFrame f{.id = 0x185, .size = 2, .data = {0x00, 0x11}};
  EXPECT_EQ(candump_line(Time(12s + 345678us + 999ns), f), "(0000000012.345678) can0 185#0011");
  EXPECT_EQ(candump_line(Time{}, {.id = 0x080}, "vcan7"), "(0000000000.000000) vcan7 080#");
  EXPECT_EQ(candump_line(Time(1us), {.id = 0x001, .size = 8, .data = {0xFE}}),
            "(0000000000.000001) can0 001#FE00000000000000");
  EXPECT_EQ(candump_line(Time{}, {.id = 0x18FF1021 | kExtendedId, .size = 1, .data = {0xAB}}),
            "(0000000000.000000) can0 18FF1021#AB");
  EXPECT_EQ(candump_line(Time{}, {.id = 0x21 | kExtendedId}), "(0000000000.000000) can0 00000021#");
}

TEST(CanBus, FramesLostAreErrorsOnEitherSideOfAThreadBorder) {
  VirtualCanBus bus(2, 500'000);
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
