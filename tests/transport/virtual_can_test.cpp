#include "transport/virtual_can.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/error.h"
#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

CanFrame small_frame(std::uint32_t id, std::uint8_t size = 8, std::uint8_t first = 0) {
  CanFrame result;
  result.id = id;
  result.size = size;
  result.data[0] = first;
  return result;
}

struct Recorder {
  struct Entry {
    Time at{};
    CanFrame small_frame;
  };
  std::vector<Entry> entries;
  CanTap tap() {
    return {[](void* self, Time at, const CanFrame& f) {
              static_cast<Recorder*>(self)->entries.push_back({at, f});
            },
            this};
  }
};

std::vector<std::uint32_t> received(CanBus& port) {
  std::vector<std::uint32_t> ids;
  for (CanFrame f; port.receive(f);) ids.push_back(f.id);
  return ids;
}

using Ids = std::vector<std::uint32_t>;

TEST(VirtualCanBus, LowestIdentifierWinsAndEqualOnesKeepTheirOrder) {
  VirtualCanBus bus(4, 500000);
  bus.port(0).send(small_frame(0x700));
  bus.port(1).send(small_frame(0x200, 1, 1));
  bus.port(2).send(small_frame(0x080, 0));
  bus.port(1).send(small_frame(0x200, 1, 2));
  bus.port(1).send(small_frame(0x180));
  Recorder recorder;
  bus.set_tap(recorder.tap());
  bus.advance(Time(10ms));
  EXPECT_EQ(received(bus.port(3)), (Ids{0x080, 0x180, 0x200, 0x200, 0x700}));
  EXPECT_EQ(received(bus.port(1)), (Ids{0x080, 0x700})) << "own frames are not heard";
  EXPECT_EQ(recorder.entries[2].small_frame.data[0], 1);
  EXPECT_EQ(recorder.entries[3].small_frame.data[0], 2);
}

TEST(VirtualCanBus, AFrameOnTheWireIsNotInterrupted) {
  VirtualCanBus bus(2, 500000);
  bus.port(0).send(small_frame(0x700));
  bus.advance(Time(100us));
  bus.port(0).send(small_frame(0x001));
  bus.advance(Time(10ms));
  EXPECT_EQ(received(bus.port(1)), (Ids{0x700, 0x001}));
}

TEST(VirtualCanBus, FramesTakeTheirWorstCaseStuffedLength) {
  // 44 + 8 n bits and 3 between frames; of the first 34 + 8 n at most every fourth is followed by a stuff bit.
  EXPECT_EQ(worst_case_bits(0), 55U);
  EXPECT_EQ(worst_case_bits(8), 135U);
  VirtualCanBus bus(2, 500000);
  Recorder recorder;
  bus.set_tap(recorder.tap());
  bus.advance(Time(1ms));
  bus.port(0).send(small_frame(0x100, 8));
  bus.port(0).send(small_frame(0x080, 0));
  bus.advance(Time(1ms + 109us));
  EXPECT_TRUE(recorder.entries.empty());
  bus.advance(Time(2ms));
  ASSERT_EQ(recorder.entries.size(), 2U);
  EXPECT_EQ(recorder.entries[0].at, Time(1ms + 110us));
  EXPECT_EQ(recorder.entries[1].at, Time(1ms + 380us));
  EXPECT_EQ(bus.busy(), 380us);
  bus.advance(Time(5s));
  bus.port(0).send(small_frame(0x080, 0));
  bus.advance(Time(6s));
  EXPECT_EQ(recorder.entries.at(2).at, Time(5s + 110us)) << "an idle bus starts when the frame is sent";
}

TEST(VirtualCanBus, FullQueuesDropAndCount) {
  VirtualCanBus bus(2, 500000);
  for (std::size_t i = 0; i < VirtualCanBus::kSendSlots; ++i) EXPECT_TRUE(bus.port(0).send(small_frame(0x100)));
  EXPECT_FALSE(bus.port(0).send(small_frame(0x100)));
  EXPECT_EQ(bus.dropped(0), 1U);
  for (int burst = 0; burst < 5; ++burst) {
    bus.advance(Time(1s * (burst + 1)));
    for (std::size_t i = 0; i < VirtualCanBus::kSendSlots; ++i) bus.port(0).send(small_frame(0x100));
  }
  EXPECT_EQ(received(bus.port(1)).size(), VirtualCanBus::kReceiveSlots);
  EXPECT_EQ(bus.dropped(1), 5 * VirtualCanBus::kSendSlots - VirtualCanBus::kReceiveSlots);
}

TEST(VirtualCanBus, APortThatIsSilentDisturbedOrWithoutCableIsHeardAndHearsAsThatAllows) {
  struct Case {
    const char* what;
    void (*set)(VirtualCanBus& bus, bool on);
    bool is_heard, hears;
    CanState own;
    Ids later;  // heard of it once that is over
  };
  const Case cases[]{
      {"silent", [](VirtualCanBus& bus, bool on) { bus.silence(0, on); }, false, true, CanState::kActive, {0x103}},
      {"disturbed", [](VirtualCanBus& bus, bool on) { bus.disturb(0, on); }, true, true, CanState::kPassive, {0x103}},
      {"without cable",
       [](VirtualCanBus& bus, bool on) { bus.disconnect(0, on); },
       false,
       false,
       CanState::kPassive,
       {0x101, 0x103}},
  };
  for (const auto& [what, set, is_heard, hears, own, later] : cases) {
    VirtualCanBus bus(3, 500000);
    set(bus, true);
    EXPECT_TRUE(bus.port(0).send(small_frame(0x101)));
    bus.port(1).send(small_frame(0x102));
    bus.advance(Time(1s));
    EXPECT_EQ(received(bus.port(0)), hears ? Ids{0x102} : Ids{}) << what;
    EXPECT_EQ(received(bus.port(2)), is_heard ? (Ids{0x101, 0x102}) : Ids{0x102}) << what << ": the others go on";
    EXPECT_EQ(bus.port(0).state(), own) << what;
    EXPECT_EQ(bus.port(1).state(), CanState::kActive) << what;
    set(bus, false);
    bus.port(0).send(small_frame(0x103));
    bus.advance(Time(2s));
    EXPECT_EQ(received(bus.port(2)), later) << what;
    EXPECT_EQ(bus.port(0).state(), CanState::kActive) << what;
  }
}

TEST(VirtualCanBus, ACutBusKeepsFramesWaitingAndShowsErrorPassive) {
  VirtualCanBus bus(2, 500000);
  bus.cut(true);
  EXPECT_EQ(bus.port(0).state(), CanState::kPassive);
  EXPECT_TRUE(bus.port(0).send(small_frame(0x100)));
  bus.advance(Time(1s));
  EXPECT_TRUE(received(bus.port(1)).empty());
  bus.cut(false);
  bus.advance(Time(2s));
  EXPECT_EQ(received(bus.port(1)), Ids{0x100});
  EXPECT_EQ(bus.port(0).state(), CanState::kActive);
}

TEST(VirtualCanBus, AControllerThatIsBusOffHearsOnceItHasRecoveredAndSendsOnceThatIsAcknowledged) {
  VirtualCanBus bus(3, 500000);
  bus.port(0).send(small_frame(0x100));
  bus.bus_off(0);
  EXPECT_EQ(bus.port(0).state(), CanState::kBusOff);
  EXPECT_FALSE(bus.port(0).send(small_frame(0x101)));
  bus.port(1).send(small_frame(0x102));
  bus.advance(Time(1s));
  EXPECT_TRUE(received(bus.port(0)).empty());
  EXPECT_EQ(received(bus.port(2)), Ids{0x102});
  bus.port(0).acknowledge();
  EXPECT_EQ(bus.port(0).state(), CanState::kBusOff) << "it still is";
  bus.recover(0);
  EXPECT_EQ(bus.port(0).state(), CanState::kBusOff);
  EXPECT_FALSE(bus.port(0).send(small_frame(0x103)));
  bus.port(1).send(small_frame(0x104));
  bus.advance(Time(2s));
  EXPECT_EQ(received(bus.port(0)), Ids{0x104});
  received(bus.port(2));
  bus.port(0).acknowledge();
  EXPECT_EQ(bus.port(0).state(), CanState::kActive);
  EXPECT_TRUE(bus.port(0).send(small_frame(0x105)));
  bus.advance(Time(3s));
  EXPECT_EQ(received(bus.port(2)), Ids{0x105});
}

TEST(VirtualCanBus, AnInterfaceThatIsDownLosesItsQueuesAndNeitherSendsNorHears) {
  VirtualCanBus bus(2, 500000);
  bus.port(0).send(small_frame(0x100));
  bus.take_down(0, true);
  EXPECT_EQ(bus.port(0).state(), CanState::kDown);
  EXPECT_FALSE(bus.port(0).send(small_frame(0x101)));
  bus.port(1).send(small_frame(0x102));
  bus.advance(Time(1s));
  bus.take_down(0, false);
  EXPECT_TRUE(received(bus.port(0)).empty());
  EXPECT_EQ(bus.port(0).state(), CanState::kActive);
  EXPECT_TRUE(bus.port(0).send(small_frame(0x103)));
  bus.advance(Time(2s));
  EXPECT_EQ(received(bus.port(1)), Ids{0x103});
}

TEST(VirtualCanBus, MovesFramesWithoutAllocating) {
  VirtualCanBus bus(2, 500000);
  CanFrame f;
  const test::NoAllocScope scope;
  for (int i = 1; i <= 100; ++i) {
    for (std::uint32_t n = 0; n < 15; ++n) bus.port(n % 2).send(small_frame(0x180 + n));
    bus.advance(Time(i * 5ms));
    while (bus.port(0).receive(f) || bus.port(1).receive(f)) {
    }
  }
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
  EXPECT_EQ(bus.frames(), 1500U);
}

TEST(VirtualCanBus, RefusesImpossibleSetUps) {
  EXPECT_THROW(VirtualCanBus(9, 500000), InputError);
  EXPECT_THROW(VirtualCanBus(2, 0), InputError);
}

}  // namespace
}  // namespace knuckle
