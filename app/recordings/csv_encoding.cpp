#include "app/recordings/csv_encoding.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

namespace knuckle::recordings {
namespace {

constexpr char32_t kReplacement = 0xfffd;

void append(std::string& text, char32_t character) {
  const auto add = [&](char32_t byte) { text += static_cast<char>(byte); };
  if (character < 0x80) return add(character);
  if (character < 0x800) {
    add(0xc0 | (character >> 6));
  } else {
    if (character < 0x10000) {
      add(0xe0 | (character >> 12));
    } else {
      add(0xf0 | (character >> 18));
      add(0x80 | ((character >> 12) & 0x3f));
    }
    add(0x80 | ((character >> 6) & 0x3f));
  }
  add(0x80 | (character & 0x3f));
}

std::string from_utf16(std::string_view bytes, bool big_endian) {
  const auto unit_at = [&](std::size_t at) {
    const auto first = static_cast<std::uint8_t>(bytes[at]), second = static_cast<std::uint8_t>(bytes[at + 1]);
    return static_cast<char32_t>(big_endian ? first << 8 | second : second << 8 | first);
  };
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
    const char32_t unit = unit_at(at);
    const bool leads = unit >= 0xd800 && unit < 0xdc00, follows = unit >= 0xdc00 && unit < 0xe000;
    const char32_t next = leads && at + 3 < bytes.size() ? unit_at(at + 2) : 0;
    if (next >= 0xdc00 && next < 0xe000) {
      append(text, 0x10000 + ((unit - 0xd800) << 10) + (next - 0xdc00));
      at += 2;
    } else {
      append(text, leads || follows ? kReplacement : unit);
    }
  }
  return text;
}

bool is_utf8(std::string_view bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const auto lead = static_cast<std::uint8_t>(bytes[at]);
    const std::size_t size = lead < 0x80   ? 1
                             : lead < 0xc2 ? 0
                             : lead < 0xe0 ? 2
                             : lead < 0xf0 ? 3
                             : lead < 0xf5 ? 4
                                           : 0;
    if (size == 0 || at + size > bytes.size()) return false;
    for (std::size_t i = 1; i < size; ++i)
      if ((static_cast<std::uint8_t>(bytes[at + i]) & 0xc0) != 0x80) return false;
    at += size;
  }
  return true;
}

/// Of the first characters' bytes at even or odd places, nearly all are zero: so is text in Latin letters.
bool has_zeros_at(std::string_view bytes, std::size_t offset) {
  constexpr std::size_t kLooked = 64;
  std::size_t zeros = 0, looked = 0;
  for (std::size_t at = offset; at < bytes.size() && looked < kLooked; at += 2, ++looked)
    zeros += bytes[at] == '\0' ? 1U : 0U;
  return looked >= 2 && 10 * zeros >= 9 * looked;
}

}  // namespace

EncodedText to_utf8(std::string bytes) {
  using namespace std::string_view_literals;
  const std::string_view all = bytes;
  if (all.starts_with("\xff\xfe"sv)) return {from_utf16(all.substr(2), false), "UTF-16"};
  if (all.starts_with("\xfe\xff"sv)) return {from_utf16(all.substr(2), true), "UTF-16"};
  if (all.starts_with("\xef\xbb\xbf"sv)) return {bytes.substr(3), "UTF-8"};
  if (has_zeros_at(all, 1)) return {from_utf16(all, false), "UTF-16"};
  if (has_zeros_at(all, 0)) return {from_utf16(all, true), "UTF-16"};
  if (is_utf8(all)) return {std::move(bytes), "UTF-8"};
  std::string text;
  text.reserve(all.size() + all.size() / 8);
  for (const char c : all) append(text, static_cast<std::uint8_t>(c));
  return {std::move(text), "Latin-1"};
}

}  // namespace knuckle::recordings
