// What travels between a rendezvous and its clients: lines of text over TCP. An end joins a room for each far end; what
// it sends there goes to the others in the room, as it is.
//
//   to the rendezvous:  join ROOM | send ROOM MESSAGE | ping
//   from it:            joined ROOM COUNT | entered ROOM | message ROOM MESSAGE | pong | refused WHY
//
// ROOM: 64 hexadecimal digits. COUNT: others in it. MESSAGE: base64.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "transport/ice/signal.h"

namespace knuckle::ice {

inline constexpr std::size_t kRoomSize = 64;
inline constexpr std::size_t kMostRooms = 32;  ///< Of one connection.
inline constexpr std::size_t kMostMessageText = (kMostSignal + 2) / 3 * 4;
/// Without its end.
inline constexpr std::size_t kMostLine = 8 + kRoomSize + 1 + kMostMessageText;

/// Where two ends meet: only who knows both fingerprints can name it.
[[nodiscard]] std::string room_of(const secure::Fingerprint& one, const secure::Fingerprint& other);

[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);
/// At most kMostSignal bytes; nullopt for anything that base64() does not make.
[[nodiscard]] std::optional<Bytes> bytes_of_base64(std::string_view text);

/// A line in its words; those that it has not are empty.
struct Line {
  std::string_view verb, room, rest;
};
/// To the rendezvous. nullopt for what is none of these lines; whether MESSAGE is base64 is left to who uses it, it has
/// base64's characters only.
[[nodiscard]] std::optional<Line> parse_request(std::string_view line);
/// From the rendezvous, likewise. WHY: printable characters, at most 100.
[[nodiscard]] std::optional<Line> parse_notice(std::string_view line);

/// Lines out of a stream of bytes.
class LineBuffer {
 public:
  /// @return false once a line is longer than kMostLine: the stream is of no more use.
  [[nodiscard]] bool add(std::string_view bytes);
  /// The next whole line, without its end (LF, or CR LF).
  [[nodiscard]] std::optional<std::string> next();

 private:
  std::string held_;
};

}  // namespace knuckle::ice
