// What frames are closed with: against published check values, and by literal bytes.
#include "transport/frame_checksum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

using Kind = FrameChecksum::Kind;
using Order = BitField::Order;
constexpr auto kUnsigned = BitField::Type::kUnsigned;
constexpr BitField kLastByte{kUnsigned, Order::kLittleEndian, 56, 8};

CanFrame frame_of(std::initializer_list<std::uint8_t> bytes) {
  CanFrame frame{.id = 0x130, .size = static_cast<std::uint8_t>(bytes.size())};
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}
/// Over the first bytes of a frame, in their order; it stands where no field can be.
FrameChecksum over(Kind kind, std::uint8_t bytes) {
  FrameChecksum checksum{.kind = kind, .field = {kUnsigned, Order::kLittleEndian, 64, 8}, .byte_count = bytes};
  for (std::uint8_t i = 0; i < 8; ++i) checksum.bytes[i] = i;
  return checksum;
}

TEST(FrameChecksum, HasThePublishedCheckValuesOverNineDigits) {
  const CanFrame first_eight = frame_of({'1', '2', '3', '4', '5', '6', '7', '8'});
  const CanFrame last_eight = frame_of({'2', '3', '4', '5', '6', '7', '8', '9'});
  struct Case {
    Kind kind;
    std::uint8_t check;
  };
  for (const Case& c : std::initializer_list<Case>{
           {Kind::kCrc8J1850, 0x4B}, {Kind::kCrc8H2f, 0xDF}, {Kind::kSum, 0xDD}, {Kind::kXor, 0x31}}) {
    FrameChecksum checksum = over(c.kind, 8);
    checksum.data_id = {'9', 0x77};
    checksum.data_id_count = 1;
    EXPECT_EQ(checksum_of(checksum, first_eight), c.check);
    checksum.data_id = {'1', 0x77};
    checksum.data_id_first = true;
    EXPECT_EQ(checksum_of(checksum, last_eight), c.check);
  }
}

TEST(FrameChecksum, GoesOverTheStatedBytesInTheStatedOrder) {
  const CanFrame frame = frame_of({0xF2, 0x99, 0x83, 0x01, 0x77});
  FrameChecksum checksum = over(Kind::kCrc8J1850, 3);
  checksum.bytes = {0, 3, 2};
  EXPECT_EQ(checksum_of(checksum, frame), 0x37);
  checksum.bytes = {2, 3, 0};
  EXPECT_NE(checksum_of(checksum, frame), 0x37);
  checksum.bytes = {3, 2};
  checksum.byte_count = 2;
  checksum.data_id = {0xF2};
  checksum.data_id_count = 1;
  checksum.data_id_first = true;
  EXPECT_EQ(checksum_of(checksum, frame), 0x37);
  checksum.bytes = {0};
  checksum.byte_count = 1;
  checksum.data_id = {0x01, 0x83};
  checksum.data_id_count = 2;
  checksum.data_id_first = false;
  EXPECT_EQ(checksum_of(checksum, frame), 0x37);
}

TEST(FrameChecksum, ClosesAFrameByteForByte) {
  const FrameCounter counter{.field = {kUnsigned, Order::kLittleEndian, 48, 8}};
  FrameClosing closing{counter, over(Kind::kSum, 7)};
  closing.checksum->field = kLastByte;
  CanFrame frame = frame_of({1, 2, 3, 4, 5, 6, 0xEE, 0xEE});
  close_frame(closing, 7, frame);
  EXPECT_EQ(frame, frame_of({1, 2, 3, 4, 5, 6, 7, 28}));
  closing.checksum->kind = Kind::kXor;
  close_frame(closing, 8, frame);
  EXPECT_EQ(frame, frame_of({1, 2, 3, 4, 5, 6, 8, 15}));
  closing.checksum->kind = Kind::kCrc8J1850;
  frame = frame_of({0xF2, 0x01, 0x83});
  closing = {std::nullopt, over(Kind::kCrc8J1850, 3)};
  closing.checksum->field = {kUnsigned, Order::kLittleEndian, 24, 8};
  close_frame(closing, 9, frame);
  EXPECT_EQ(frame, frame_of({0xF2, 0x01, 0x83, 0x37}));
}

TEST(FrameChecksum, TakesItsOwnBitsForZeroAndLeavesOthersInItsByteAlone) {
  // Counter and checksum share a byte: four bits each.
  FrameClosing closing{FrameCounter{.field = {kUnsigned, Order::kBigEndian, 15, 4}}, over(Kind::kSum, 2)};
  closing.checksum->field = {kUnsigned, Order::kBigEndian, 11, 4};
  CanFrame frame = frame_of({0x12, 0x0F});
  close_frame(closing, 5, frame);
  EXPECT_EQ(frame, frame_of({0x12, 0x52}));  // 0x12 + 0x50 = 0x62
  EXPECT_EQ(check_frame(closing, 4, frame).fault, FrameFault::kNone);
}

FrameClosing closing_of(std::uint64_t modulus) {
  FrameClosing closing{FrameCounter{.field = {kUnsigned, Order::kLittleEndian, 52, 4}, .modulus = modulus},
                       over(Kind::kCrc8H2f, 7)};
  closing.checksum->field = kLastByte;
  return closing;
}

TEST(FrameCounter, GoesOnByOneAndFromItsModulusToZero) {
  const FrameCounter stated{.field = {kUnsigned, Order::kLittleEndian, 0, 4}, .modulus = 15},
      by_bits{.field = {kUnsigned, Order::kLittleEndian, 0, 4}},
      wide{.field = {kUnsigned, Order::kLittleEndian, 0, 64}};
  EXPECT_EQ(next_count(stated, 13), 14U);
  EXPECT_EQ(next_count(stated, 14), 0U);
  EXPECT_EQ(next_count(by_bits, 14), 15U);
  EXPECT_EQ(next_count(by_bits, 15), 0U);
  EXPECT_EQ(next_count(wide, 0xFFFFFFFF), 0x100000000U);
  EXPECT_EQ(next_count(wide, ~std::uint64_t{0}), 0U);
}

TEST(FrameCounter, AllFramesOfASenderAreAcceptedRoundAfterRound) {
  for (const std::uint64_t modulus : {std::uint64_t{0}, std::uint64_t{15}, std::uint64_t{2}}) {
    const FrameClosing closing = closing_of(modulus);
    std::optional<std::uint64_t> previous;
    std::uint64_t count = 0;
    for (std::uint8_t n = 0; n < 100; ++n) {
      CanFrame frame = frame_of({n, 2, 3, 4, 5, 6, 7, 8});
      close_frame(closing, count, frame);
      const FrameCheck check = check_frame(closing, previous, frame);
      EXPECT_EQ(check.fault, FrameFault::kNone) << int{n};
      EXPECT_EQ(check.count, count);
      previous = check.count;
      count = next_count(*closing.counter, count);
    }
  }
}

TEST(FrameCounter, TellsARepeatedAndASkippedCount) {
  const FrameClosing closing = closing_of(15);
  const auto check = [&](std::uint64_t previous, std::uint64_t count) {
    CanFrame frame = frame_of({1, 2, 3, 4, 5, 6, 7, 8});
    close_frame(closing, count, frame);
    return check_frame(closing, previous, frame);
  };
  EXPECT_EQ(check(5, 5).fault, FrameFault::kCounterRepeated);
  EXPECT_EQ(check(5, 7).fault, FrameFault::kCounterSkipped);
  EXPECT_EQ(check(5, 7).count, 7U);  // goes on from there
  EXPECT_EQ(check(5, 4).fault, FrameFault::kCounterSkipped);
  EXPECT_EQ(check(14, 0).fault, FrameFault::kNone);
  EXPECT_EQ(check(13, 0).fault, FrameFault::kCounterSkipped);
  EXPECT_EQ(check(14, 15).fault, FrameFault::kCounterRepeated) << "beyond its modulus: no count";
  EXPECT_EQ(check(14, 15).count, 14U);
}

TEST(FrameChecksum, EveryWrongBitIsToldAndItsCounterDoesNotCount) {
  const FrameClosing closing = closing_of(0);
  CanFrame frame = frame_of({1, 2, 3, 4, 5, 6, 7, 8});
  close_frame(closing, 3, frame);
  for (unsigned bit = 0; bit < 64; ++bit) {
    CanFrame wrong = frame;
    wrong.data[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    const FrameCheck check = check_frame(closing, 2, wrong);
    EXPECT_EQ(check.fault, FrameFault::kChecksumWrong) << bit;
    EXPECT_EQ(check.count, 2U);
  }
}

TEST(FrameChecksum, OfAFrameThatIsTooShortIsNotGuessed) {
  FrameClosing closing = closing_of(0);
  CanFrame frame = frame_of({1, 2, 3, 4, 5, 6, 7, 8});
  close_frame(closing, 3, frame);
  frame.size = 7;  // without the checksum
  EXPECT_EQ(check_frame(closing, 2, frame).fault, FrameFault::kTooShort);
  closing.checksum->field = {kUnsigned, Order::kLittleEndian, 0, 8};
  frame.size = 6;  // without a byte that is summed
  EXPECT_EQ(check_frame(closing, 2, frame).fault, FrameFault::kTooShort);
  closing.checksum.reset();  // without the counter
  EXPECT_EQ(check_frame(closing, 2, frame).fault, FrameFault::kTooShort);
  EXPECT_EQ(check_frame(closing, 2, frame).count, 2U);
  EXPECT_EQ(check_frame({}, std::nullopt, frame).fault, FrameFault::kNone);
}

TEST(FrameChecksum, AllocatesNothing) {
  const FrameClosing closing = closing_of(15);
  CanFrame frame = frame_of({1, 2, 3, 4, 5, 6, 7, 8});
  const test::NoAllocScope scope;
  close_frame(closing, 3, frame);
  const FrameCheck check = check_frame(closing, 2, frame);
  EXPECT_EQ(scope.allocations(), 0U);
  EXPECT_EQ(check.fault, FrameFault::kNone);
}

}  // namespace
}  // namespace knuckle
