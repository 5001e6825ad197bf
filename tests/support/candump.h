// An independent reader of candump logs: knows the text format and nothing of the project's own codecs, so that what
// went over the CAN wire can be judged by somebody else than those who sent it.
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <regex>
#include <stdexcept>
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

/// "(0000000012.345678) can0 185#0011223344556677"; nullopt for anything else.
inline std::optional<WireFrame> parse_candump_line(const std::string& line) {
  static const std::regex format(R"(\((\d+\.\d{6})\) \w+ ([0-9A-F]{3})#((?:[0-9A-F]{2}){0,8}))");
  std::smatch parts;
  if (!std::regex_match(line, parts, format)) return std::nullopt;
  WireFrame frame{std::stod(parts[1]), static_cast<unsigned>(std::stoul(parts[2], nullptr, 16)), {}};
  const std::string hex = parts[3];
  for (std::size_t i = 0; i < hex.size(); i += 2)
    frame.data.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  return frame;
}

/// @throws std::runtime_error with the line that is no frame, or that goes back in time.
inline std::vector<WireFrame> read_candump(std::istream& log) {
  std::vector<WireFrame> frames;
  for (std::string line; std::getline(log, line);) {
    const auto frame = parse_candump_line(line);
    if (!frame || (!frames.empty() && frame->at_s < frames.back().at_s))
      throw std::runtime_error("line " + std::to_string(frames.size() + 1) + ": " + line);
    frames.push_back(*frame);
  }
  return frames;
}

}  // namespace knuckle::test
