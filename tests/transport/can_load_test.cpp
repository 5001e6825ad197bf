// Bits and shares against a frame written out as text, bit by bit, by somebody who knows nothing of the code.
#include "transport/can_load.h"

#include <gtest/gtest.h>

#include <random>

namespace knuckle {
namespace {

std::string binary(std::uint32_t value, std::size_t digits) {
  std::string text;
  for (std::size_t i = digits; i-- > 0;) text += (value >> i & 1U) != 0 ? '1' : '0';
  return text;
}

/// Remainder of the text, followed by 15 zeros, divided by x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1: by hand.
std::string crc(const std::string& text) {
  const std::string divisor = "1100010110011001";
  std::string rest = text + std::string(15, '0');
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (rest[i] == '0') continue;
    for (std::size_t k = 0; k < divisor.size(); ++k) rest[i + k] = rest[i + k] == divisor[k] ? '0' : '1';
  }
  return rest.substr(text.size());
}

std::string stuffed(const std::string& text) {
  std::string out;
  for (const char bit : text) {
    out += bit;
    const std::size_t n = out.size();
    if (n >= 5 && out.substr(n - 5) == std::string(5, bit)) out += bit == '0' ? '1' : '0';
  }
  return out;
}

std::size_t bits_by_hand(const CanFrame& frame) {
  std::string text = "0" + binary(frame.id, 11) + "000";
  if ((frame.id & kExtendedId) != 0) {  // SRR and IDE between the 11 higher bits and the 18 lower; then RTR, r1, r0
    const std::string id = binary(frame.id & 0x1FFFFFFF, 29);
    text = "0" + id.substr(0, 11) + "11" + id.substr(11) + "000";
  }
  text += binary(frame.size, 4);
  for (std::size_t i = 0; i < frame.size; ++i) text += binary(frame.data[i], 8);
  const std::string tail = "1" + std::string("01") + "1111111" + "111";  // CRC delimiter, ACK, end of frame, interframe
  return (stuffed(text + crc(text)) + tail).size();
}

TEST(CanLoad, BitsOfAFrameWithoutAndWithEveryStuffBit) {
  EXPECT_EQ(least_bits(0), 47U);
  EXPECT_EQ(least_bits(8), 111U);
  EXPECT_EQ(worst_case_bits(0), 55U);
  EXPECT_EQ(worst_case_bits(8), 135U);
  EXPECT_EQ(least_bits(8, kExtendedId), 131U);
  EXPECT_EQ(worst_case_bits(8, kExtendedId), 160U);
}

TEST(CanLoad, BitsOfAFrameAreThoseThatLeave) {
  std::mt19937 random(7);
  for (int i = 0; i < 2000; ++i) {
    const std::uint32_t id = i % 2 == 0 ? random() % 0x800 : random() % 0x20000000 | kExtendedId;
    CanFrame frame{id, static_cast<std::uint8_t>(random() % 9), {}};
    const auto kind = static_cast<unsigned>(random() % 3);  // long runs of equal bits, or any
    for (auto& byte : frame.data) byte = kind == 0 ? 0x00 : static_cast<std::uint8_t>(kind == 1 ? 0xFF : random());
    ASSERT_EQ(frame_bits(frame), bits_by_hand(frame)) << "frame " << i;
    ASSERT_GE(frame_bits(frame), least_bits(frame.size, frame.id));
    ASSERT_LE(frame_bits(frame), worst_case_bits(frame.size, frame.id));
  }
}

TEST(CanLoad, SharesOfPeriodicFramesAddUp) {
  const std::array<PeriodicFrame, 2> frames{{{0x080, 0, 200}, {0x1A0, 8, 100}}};
  const CanLoad load = can_load(frames, 125000);
  EXPECT_DOUBLE_EQ(load.least, (200 * 47 + 100 * 111) / 125e3);
  EXPECT_DOUBLE_EQ(load.worst_case, (200 * 55 + 100 * 135) / 125e3);
}

}  // namespace
}  // namespace knuckle
