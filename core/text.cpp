#include "core/text.h"

#include <array>
#include <cstdint>
#include <ctime>

namespace knuckle {
namespace {

constexpr std::size_t kLongestMessage = 4000, kMessageBegin = 2900, kMessageEnd = 1000;  // characters

/// A character of UTF-8, or a byte that belongs to none.
struct Character {
  std::size_t bytes = 1;
  bool printable = false;
};

bool is_control(std::uint32_t code) {
  const bool turns_direction =
      code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029 || turns_direction;
}

/// The one at the front of text, which is not empty. Strict: no overlong forms, surrogates or codes above 10FFFF.
Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  if (lead < 0x80) return {1, !is_control(lead)};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = lead & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3FU);
  }
  const std::uint32_t least = bytes == 4 ? 0x10000 : bytes == 3 ? 0x800 : 0x80;
  if (code < least || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {};
  return {bytes, !is_control(code)};
}

std::size_t characters_in(std::string_view text) {
  std::size_t count = 0;
  for (std::size_t at = 0; at < text.size(); at += first_of(text.substr(at)).bytes) ++count;
  return count;
}

/// Bytes of its first `count` characters.
std::size_t bytes_of(std::string_view text, std::size_t count) {
  std::size_t at = 0;
  for (; count > 0 && at < text.size(); --count) at += first_of(text.substr(at)).bytes;
  return at;
}

}  // namespace

namespace {

/// @param kept control characters that stay as they are.
std::string printable_but(std::string_view text, std::string_view kept) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const Character character = first_of(text.substr(at));
    for (const char c : text.substr(at, character.bytes)) {
      if (character.printable || kept.find(c) != std::string_view::npos) {
        result += c;
      } else {
        const auto byte = static_cast<std::uint8_t>(c);
        result.append("\\x").append(1, kDigits[byte >> 4]).append(1, kDigits[byte & 0xF]);
      }
    }
    at += character.bytes;
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) {
  return printable_but(text, "");
}

std::string printable_lines(std::string_view text) {
  return printable_but(text, "\n\t");
}

std::string shortened(std::string_view text, std::size_t longest) {
  if (text.size() <= longest) return printable(text);  // has no more characters than bytes
  const std::size_t count = characters_in(text);
  if (count <= longest) return printable(text);
  return printable(text.substr(0, bytes_of(text, longest))) + "... (" + std::to_string(count) + " characters)";
}

std::string one_message(std::string_view text) {
  const std::string whole = printable(text);
  const std::size_t count = whole.size() <= kLongestMessage ? 0 : characters_in(whole);
  if (count <= kLongestMessage) return whole;
  return whole.substr(0, bytes_of(whole, kMessageBegin)) + "... (" + std::to_string(count) + " characters) ..." +
         whole.substr(bytes_of(whole, count - kMessageEnd));
}

std::string utc_text(std::int64_t unix_s, const char* format) {
  const std::time_t seconds = unix_s;
  std::tm utc{};
  std::array<char, 64> text{};
  if (::gmtime_r(&seconds, &utc) != nullptr) (void)std::strftime(text.data(), text.size(), format, &utc);
  return text.data();
}

}  // namespace knuckle
