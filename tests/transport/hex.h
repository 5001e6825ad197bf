// Bytes written by hand in tests: "01 FE" to a vector.
#pragma once

#include <cctype>
#include <cstdint>
#include <string>
#include <vector>

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

}  // namespace knuckle::test
