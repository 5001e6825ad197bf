#include "tests/support/candump.h"

#include <istream>
#include <optional>
#include <regex>
#include <stdexcept>

namespace knuckle::test {
namespace {

/// "(0000000012.345678) can0 185#0011223344556677"; nullopt for anything else.
std::optional<WireFrame> parse_candump_line(const std::string& line) {
  static const std::regex format(R"(\((\d+\.\d{6})\) \w+ ([0-9A-F]{3}|[0-9A-F]{8})#((?:[0-9A-F]{2}){0,8}))");
  std::smatch parts;
  if (!std::regex_match(line, parts, format)) return std::nullopt;
  WireFrame frame{std::stod(parts[1]), static_cast<unsigned>(std::stoul(parts[2], nullptr, 16)), {}};
  const std::string hex = parts[3];
  for (std::size_t i = 0; i < hex.size(); i += 2)
    frame.data.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  return frame;
}

}  // namespace

std::vector<WireFrame> read_candump(std::istream& log) {
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
