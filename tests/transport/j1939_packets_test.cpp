// Messages of several packets: what is on the wire, and how one sender's are put together.
#include "transport/j1939_packets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/no_alloc.h"

namespace knuckle::j1939 {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kAnnounced = 0x1CECFF21U | kExtendedId, kPacket = 0x1CEBFF21U | kExtendedId;

CanFrame frame(std::uint32_t id, const Bytes& data) {
  CanFrame frame{.id = id, .size = static_cast<std::uint8_t>(data.size()), .data = {}};
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

Bytes counted(std::size_t bytes, std::uint8_t from = 1) {
  Bytes message(bytes);
  for (std::uint8_t& byte : message) byte = from++;
  return message;
}

TEST(J1939Packets, AreOnTheWireAsTheStandardSays) {
  EXPECT_EQ(announcement_frame(0xFEE3, 0x21, 39), frame(kAnnounced, {32, 39, 0, 6, 0xFF, 0xE3, 0xFE, 0}));
  const Bytes message = counted(9);
  EXPECT_EQ(packet_frame(0x21, 1, message), frame(kPacket, {1, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(packet_frame(0x21, 2, message), frame(kPacket, {2, 8, 9, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(announced(frame(kAnnounced, {32, 39, 0, 6, 0xFF, 0xE3, 0xFE, 0})), (Announcement{0xFEE3, 39, 6}));
  EXPECT_EQ(announced(frame(0x18ECFF21U | kExtendedId, {32, 0xF9, 6, 255, 0xFF, 0xE3, 0xFE, 1})),
            (Announcement{0x1FEE3, 1785, 255}))
      << "with any priority, and as long as can be";
  EXPECT_EQ(packet_number(frame(kPacket, {255, 1, 2, 3, 4, 5, 6, 7})), 255);
}

TEST(J1939Packets, WhatIsNotForEverybodyOrDoesNotFitIsNone) {
  const Bytes good{32, 39, 0, 6, 0xFF, 0xE3, 0xFE, 0};
  ASSERT_TRUE(announced(frame(kAnnounced, good)));
  const auto with = [&](std::size_t place, std::uint8_t value) {
    Bytes data = good;
    data[place] = value;
    return announced(frame(kAnnounced, data));
  };
  EXPECT_FALSE(with(0, 16)) << "a connection";
  EXPECT_FALSE(with(3, 5)) << "too few packets";
  EXPECT_FALSE(with(3, 7)) << "too many";
  EXPECT_FALSE(with(1, 8)) << "fits a frame";
  EXPECT_FALSE(with(2, 7)) << "more than 255 packets";
  EXPECT_FALSE(announced(frame(0x1CECF921U | kExtendedId, good))) << "for one alone";
  EXPECT_FALSE(announced(frame(kAnnounced, {32, 39, 0, 6, 0xFF, 0xE3, 0xFE})));
  EXPECT_FALSE(announced(frame(kAnnounced & ~kExtendedId, good)));
  EXPECT_FALSE(packet_number(frame(0x1CEBF921U | kExtendedId, {1, 1, 2, 3, 4, 5, 6, 7})));
  EXPECT_FALSE(packet_number(frame(kPacket, {0, 1, 2, 3, 4, 5, 6, 7})));
  EXPECT_FALSE(packet_number(frame(kPacket, {1, 1, 2, 3})));
}

struct Read {
  void begin(std::size_t bytes) {
    message = counted(bytes);
    reader.begin(announced(announcement_frame(0xFEE3, 0x21, bytes)).value(), now);
  }
  std::optional<PacketReader::Lost> add(std::uint8_t number) {
    return reader.add(number, packet_frame(0x21, number, message), now);
  }
  [[nodiscard]] Bytes whole() const { return {reader.message().begin(), reader.message().end()}; }
  PacketReader reader;
  Bytes message;
  Time now{10s};
};

TEST(J1939Packets, OfAllLengthsAreRead) {
  Read read;
  for (std::size_t bytes = kLeastMessage; bytes <= 300; ++bytes) {
    read.begin(bytes);
    for (unsigned i = 1; i <= packets_of(static_cast<unsigned>(bytes)); ++i, read.now += 750ms) {
      EXPECT_TRUE(read.whole().empty()) << bytes;
      ASSERT_FALSE(read.add(static_cast<std::uint8_t>(i)));
    }
    EXPECT_FALSE(read.reader.under_way());
    Bytes want = read.message;
    want.resize(std::min<std::size_t>(bytes, kMostMessage));
    ASSERT_EQ(read.whole(), want) << bytes;
  }
}

TEST(J1939Packets, ThatAreMissingTwiceOrLateEndTheMessage) {
  Read read;
  const auto lost = [](const std::optional<PacketReader::Lost>& one) { return one ? one->packet * 100 + one->of : 0; };
  read.begin(20);
  (void)read.add(1);
  EXPECT_EQ(lost(read.add(3)), 203);
  EXPECT_FALSE(read.add(2)) << "it is over";
  EXPECT_TRUE(read.whole().empty());
  read.begin(20);
  (void)read.add(1);
  EXPECT_EQ(lost(read.add(1)), 203) << "twice";
  read.begin(20);
  read.now += 751ms;
  EXPECT_EQ(lost(read.add(1)), 103) << "late";
  read.begin(20);
  (void)read.add(1);
  read.now += 750ms;
  EXPECT_FALSE(read.reader.step(read.now));
  read.now += 1ms;
  EXPECT_EQ(lost(read.reader.step(read.now)), 203) << "not at all";
  EXPECT_FALSE(read.reader.step(read.now)) << "once";
  read.begin(20);
  (void)read.add(1);
  read.begin(9);
  for (std::uint8_t number = 1; number <= 2; ++number) EXPECT_FALSE(read.add(number));
  EXPECT_EQ(read.whole(), counted(9)) << "a new one replaces it";
}

TEST(J1939Packets, TakeNoMemory) {
  Read read;
  read.message = counted(20);
  const test::NoAllocScope scope;
  read.reader.begin({0xFEE3, 20, 3}, read.now);
  for (std::uint8_t number = 1; number <= 3; ++number) (void)read.add(number);
  EXPECT_EQ(read.reader.message().size(), 20U);
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::j1939
