// What every message of the link begins with: who sent it, as which of its messages, and what it has heard.
#pragma once

#include <cstdint>

#include "core/time.h"

namespace knuckle {

/// Most that is added to an echoed time for having been held: echoes of a peer that fell silent grow old, so each side
/// sees in its round trip when only the way back is dead. Four periods of the slower sender.
inline constexpr Duration kMostHeld = 20ms;

struct LinkStamp {
  std::uint64_t session = 0;         ///< Of the sender, drawn at its start; 0 is none.
  std::uint64_t echoed_session = 0;  ///< Of the newest message that the sender has heard; 0: none yet.
  std::uint32_t sequence = 0;        ///< Of each kind of message by itself.
  Time sent_at{};                    ///< Sender's clock, from an origin drawn at its start.
  Time echoed{};  ///< sent_at of the newest message of echoed_session + how long it was held, up to kMostHeld.
};

/// Serial-number arithmetic (RFC 1982): is a newer than b?
[[nodiscard]] constexpr bool newer(std::uint32_t a, std::uint32_t b) noexcept {
  return static_cast<std::int32_t>(a - b) > 0;
}

}  // namespace knuckle
