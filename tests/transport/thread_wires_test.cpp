#include "transport/thread_wires.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>

#include "tests/support/no_alloc.h"
#include "transport/can_buses.h"
#include "transport/virtual_can.h"

namespace knuckle {
namespace {

CanFrame numbered(std::uint32_t n) {
  return {.id = 0x200, .size = 4, .data = {std::uint8_t(n), std::uint8_t(n >> 8), std::uint8_t(n >> 16)}};
}
std::uint32_t number_of(const CanFrame& frame) {
  return std::uint32_t{frame.data[0]} | std::uint32_t{frame.data[1]} << 8 | std::uint32_t{frame.data[2]} << 16;
}

TEST(ThreadCan, FramesReachTheBusAndComeBackFromIt) {
  VirtualCanBus bus(2, 500'000);
  ThreadCan can;
  EXPECT_TRUE(can.controller().send(numbered(7)));
  can.exchange(bus.port(0));
  bus.advance(Time(1ms));
  CanFrame frame;
  ASSERT_TRUE(bus.port(1).receive(frame));
  EXPECT_EQ(frame, numbered(7));
  bus.port(1).send(numbered(8));
  bus.advance(Time(2ms));
  can.exchange(bus.port(0));
  ASSERT_TRUE(can.controller().receive(frame));
  EXPECT_EQ(frame, numbered(8));
  EXPECT_FALSE(can.controller().receive(frame));
}

TEST(ThreadCan, TheLoopSeesTheStateOfEachOfTwoAndAcknowledgesIt) {
  VirtualCanBus first(2, 500'000), second(2, 250'000);
  CanBuses both(first.port(0), &second.port(0));
  ThreadCan can;
  EXPECT_EQ(can.controller().state(), CanState::kActive);
  first.bus_off(0);
  second.disturb(0, true);
  can.exchange(both);
  EXPECT_EQ(can.controller().state(), CanState::kBusOff);
  EXPECT_EQ(can.controller().states(), (std::array{CanState::kBusOff, CanState::kPassive}));
  EXPECT_EQ(can.controller().state_of(), 0);
  first.recover(0);
  can.controller().acknowledge();
  can.exchange(both);
  EXPECT_EQ(can.controller().state(), CanState::kPassive);
}

TEST(ThreadCan, AFullQueueRefusesAndCounts) {
  ThreadCan can;
  int accepted = 0;
  for (std::uint32_t n = 0; n < 100; ++n) accepted += can.controller().send(numbered(n));
  EXPECT_EQ(accepted, 64);
  EXPECT_EQ(can.dropped(), 36u);
}

TEST(ThreadCan, AllocatesNothing) {
  VirtualCanBus bus(2, 500'000);
  ThreadCan can;
  test::NoAllocScope scope;
  can.controller().send(numbered(1));
  can.exchange(bus.port(0));
  EXPECT_EQ(scope.allocations(), 0u);
}

/// Sends every frame straight back, as a port that is always free.
class Echo final : public CanBus {
 public:
  bool send(const CanFrame& frame) noexcept override { return ring_.push(frame); }
  bool receive(CanFrame& frame) noexcept override { return ring_.pop(frame); }
  [[nodiscard]] CanState state() const noexcept override { return CanState::kActive; }

 private:
  Ring<CanFrame, 64> ring_;
};

TEST(ThreadCanThreads, FramesCrossBothWaysInOrder) {
  constexpr std::uint32_t kFrames = 20'000;
  ThreadCan can;
  std::atomic<bool> done{false};
  std::thread bus([&] {
    Echo port;
    while (!done.load()) {
      can.exchange(port);
      std::this_thread::yield();
    }
  });
  std::uint32_t sent = 0, back = 0, wrong = 0;
  for (CanFrame frame; back < kFrames;) {
    // No more on the way than the echo's queue holds, so that nothing is dropped.
    if (sent < kFrames && sent - back < 32) can.controller().send(numbered(sent++));
    while (can.controller().receive(frame)) wrong += number_of(frame) != back++;
    std::this_thread::yield();
  }
  done.store(true);
  bus.join();
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(can.dropped(), 0u);
}

TEST(ThreadHidThreads, ReportsCrossInOrder) {
  constexpr int kReports = 20'000;
  ThreadHid cable;
  std::thread firmware([&] {
    int answered = 0;
    for (HidReport report; answered < kReports;) {
      while (cable.device().read(report)) answered += cable.device().write(report);
      std::this_thread::yield();
    }
  });
  int sent = 0, back = 0, wrong = 0;
  for (HidReport report{}; back < kReports;) {
    report[1] = static_cast<std::uint8_t>(sent);
    if (sent < kReports && sent - back < 32) sent += cable.host().write(report);
    while (cable.host().read(report)) wrong += report[1] != static_cast<std::uint8_t>(back++);
    std::this_thread::yield();
  }
  firmware.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(cable.dropped(), 0u);
}

}  // namespace
}  // namespace knuckle
