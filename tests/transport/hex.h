// Bytes written by hand in tests: "01 FE" to a vector, "185#0011" to a CAN frame.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <string>
#include <vector>

#include "transport/can_bus.h"

namespace knuckle::test {

inline std::vector<std::uint8_t> hex(const std::string& text) {
  std::string digits;
  for (const char c : text) {
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) digits += c;
  }
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// As candump writes it, with at most 8 bytes.
inline CanFrame frame(const std::string& text) {
  CanFrame result;
  const auto hash = text.find('#');
  result.id = static_cast<std::uint32_t>(std::stoul(text.substr(0, hash), nullptr, 16));
  const auto data = hex(text.substr(hash + 1));
  result.size = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), result.data.begin());
  return result;
}

}  // namespace knuckle::test
