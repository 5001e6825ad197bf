#include "transport/ice/rendezvous_line.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>

namespace knuckle::ice {
namespace {

constexpr std::size_t kMostWhy = 100;

bool is_room(std::string_view text) {
  const auto digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return text.size() == kRoomSize && std::all_of(text.begin(), text.end(), digit);
}

bool is_message(std::string_view text) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' || c == '/' ||
           c == '=';
  };
  return !text.empty() && text.size() <= kMostMessageText && text.size() % 4 == 0 &&
         std::all_of(text.begin(), text.end(), allowed);
}

bool is_count(std::string_view text) {
  return !text.empty() && text.size() <= 4 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool is_printable(std::string_view text) {
  return text.size() <= kMostWhy && std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

/// The first word, and what comes after one space.
std::pair<std::string_view, std::string_view> cut(std::string_view text) {
  const auto space = text.find(' ');
  if (space == std::string_view::npos) return {text, {}};
  return {text.substr(0, space), text.substr(space + 1)};
}

Line parts_of(std::string_view text) {
  const auto [verb, after] = cut(text);
  const auto [room, rest] = cut(after);
  return {verb, room, rest};
}

}  // namespace

std::string room_of(const secure::Fingerprint& one, const secure::Fingerprint& other) {
  static constexpr std::string_view kPurpose = "knuckle rendezvous 1";
  const auto& [low, high] = std::minmax(one.bytes, other.bytes);
  Bytes all(kPurpose.begin(), kPurpose.end());
  all.insert(all.end(), low.begin(), low.end());
  all.insert(all.end(), high.begin(), high.end());
  secure::Fingerprint digest;
  EVP_Digest(all.data(), all.size(), digest.bytes.data(), nullptr, EVP_sha256(), nullptr);
  return secure::hex(digest);
}

std::string base64(std::span<const std::uint8_t> bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes.data(), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::optional<Bytes> bytes_of_base64(std::string_view text) {
  if (!is_message(text)) return std::nullopt;
  Bytes bytes(text.size() / 4 * 3);
  if (EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(text.data()),
                      static_cast<int>(text.size())) < 0)
    return std::nullopt;
  const auto padding =
      static_cast<std::size_t>(std::count(text.end() - std::min<std::ptrdiff_t>(2, std::ssize(text)), text.end(), '='));
  bytes.resize(bytes.size() - padding);
  if (bytes.size() > kMostSignal || base64(bytes) != text) return std::nullopt;
  return bytes;
}

std::optional<Line> parse_request(std::string_view line) {
  const Line parts = parts_of(line);
  if (line == "ping") return parts;
  if (!is_room(parts.room)) return std::nullopt;
  if (parts.verb == "join" && line.size() == 5 + kRoomSize) return parts;
  if (parts.verb == "send" && is_message(parts.rest)) return parts;
  return std::nullopt;
}

std::optional<Line> parse_notice(std::string_view line) {
  Line parts = parts_of(line);
  if (line == "pong") return parts;
  if (parts.verb == "refused") {
    parts.room = {};
    parts.rest = cut(line).second;
    return is_printable(parts.rest) ? std::optional(parts) : std::nullopt;
  }
  if (!is_room(parts.room)) return std::nullopt;
  if (parts.verb == "joined" && is_count(parts.rest)) return parts;
  if (parts.verb == "entered" && line.size() == 8 + kRoomSize) return parts;
  if (parts.verb == "message" && is_message(parts.rest)) return parts;
  return std::nullopt;
}

bool LineBuffer::add(std::string_view bytes) {
  held_ += bytes;
  const auto end = held_.rfind('\n');
  const std::size_t open = end == std::string::npos ? held_.size() : held_.size() - end - 1;
  return open <= kMostLine;
}

std::optional<std::string> LineBuffer::next() {
  const auto end = held_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = held_.substr(0, end);
  held_.erase(0, end + 1);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

}  // namespace knuckle::ice
