// An independent reader of candump logs: knows the text format and nothing of the project's own codecs, so that what
// went over the CAN wire can be judged by somebody else than those who sent it.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace knuckle::test {

struct WireFrame {
  double at_s = 0;
  unsigned id = 0;
  std::vector<std::uint8_t> data;

  /// Little-endian, as CANopen has it.
  [[nodiscard]] unsigned u16(std::size_t byte) const { return data.at(byte) | unsigned{data.at(byte + 1)} << 8U; }
  [[nodiscard]] int i16(std::size_t byte) const { return static_cast<std::int16_t>(u16(byte)); }
};

/// @throws std::runtime_error with the line that is no frame, or that goes back in time.
[[nodiscard]] std::vector<WireFrame> read_candump(std::istream& log);

}  // namespace knuckle::test
