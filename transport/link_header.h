// What every message of the link begins with: what it is, who sent it, as which of its messages, and what it has heard.
// And how the fields of messages travel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/time.h"
#include "transport/bytes.h"

namespace knuckle {

enum class LinkKind : std::uint8_t { kMaster = 1, kSlave = 2, kStatus = 3, kHome = 4, kReadings = 5 };
inline constexpr std::uint16_t kLinkMagic = 0x4E4B;  // "KN"
inline constexpr std::uint8_t kLinkVersion = 11;
inline constexpr std::size_t kLinkHeaderSize = 4;  ///< Magic, version, kind.

/// nullopt where the header is not one of this version. The kind may be one that nobody knows.
[[nodiscard]] inline std::optional<LinkKind> link_kind(std::span<const std::uint8_t> bytes) noexcept {
  ByteReader in(bytes);
  const bool ours = in.get<std::uint16_t>() == kLinkMagic && in.get<std::uint8_t>() == kLinkVersion;
  const auto kind = in.get<std::uint8_t>();
  if (!ours || !in.ok()) return std::nullopt;
  return static_cast<LinkKind>(kind);
}

/// Most that is added to an echoed time for having been held: echoes of a peer that fell silent grow old, so each side
/// sees in its round trip when only the way back is dead. Four periods of the slower sender.
inline constexpr Duration kMostHeld = 20ms;

struct LinkStamp {
  std::uint64_t session = 0;         ///< Of the sender, drawn at its start; 0 is none.
  std::uint64_t echoed_session = 0;  ///< Of the newest message that the sender has heard; 0: none yet.
  std::uint32_t sequence = 0;        ///< Of each kind of message by itself.
  Time sent_at{};                    ///< Sender's clock, from an origin drawn at its start.
  Time echoed{};  ///< sent_at of the newest message of echoed_session + how long it was held, up to kMostHeld.

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [session, echoed_session, sequence, sent_at, echoed] = s;
    visit("session", s.session);
    visit("echoed_session", s.echoed_session);
    visit("sequence", s.sequence);
    visit("sent_at_ns", s.sent_at);
    visit("echoed_ns", s.echoed);
  }
};

/// Serial-number arithmetic (RFC 1982): is a newer than b?
[[nodiscard]] constexpr bool newer(std::uint32_t a, std::uint32_t b) noexcept {
  return static_cast<std::int32_t>(a - b) > 0;
}

// How a field travels, behind it in its message's list (core/fields.h). A receiver refuses the whole message where a
// number is not finite or outside its bounds. No honest number comes near them, and within them no sum, square or
// difference in the loops overflows. Without one: an integer travels as it is, times as nanoseconds, bools one behind
// the other as bits of a byte.
namespace wire {

/// A number, or each of a vector.
struct Within {
  double min, max;
};
[[nodiscard]] constexpr Within within(double most) noexcept {
  return {-most, most};
}
/// The sender cuts it to the bounds: what has no bound of its own must not cost the message.
struct Cut {
  double min, max;
};
[[nodiscard]] constexpr Cut cut(double most) noexcept {
  return {-most, most};
}
/// A double as a float.
struct Single {
  double min, max;
};
/// Others than these are refused.
struct Bits {
  unsigned known;
};
/// Printable ASCII with at least one zero behind it, and nothing but zeros there.
struct Text {};

}  // namespace wire
}  // namespace knuckle
