// Whether a far end's messages are of another version of the link, so that this end can say so. On a plain link anybody
// can send such messages: they word a line and decide nothing.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>

#include "transport/link_header.h"

namespace knuckle {

// Whether a far end's link is plain or encrypted, by what its datagrams begin with, so that two ends that differ can
// say so. Anybody can send such beginnings: they word a message and decide nothing.

/// A record of DTLS (RFC 6347, 4.1): handshake, alert and so on of any version.
[[nodiscard]] inline bool is_encrypted(std::span<const std::uint8_t> datagram) noexcept {
  constexpr std::uint8_t kFirstType = 20, kLastType = 25, kVersion = 0xFE;
  return datagram.size() > 1 && datagram[0] >= kFirstType && datagram[0] <= kLastType && datagram[1] == kVersion;
}

/// A message of a plain link (link_messages.h) of any version, or kPlainHere.
[[nodiscard]] inline bool is_plain(std::span<const std::uint8_t> datagram) noexcept {
  return ByteReader(datagram).get<std::uint16_t>() == kLinkMagic;
}

/// What a plain end answers to an encrypted one, and the other way round: an alert (unexpected_message) of DTLS 1.2.
/// Both are shorter than what they answer.
inline constexpr std::array<std::uint8_t, kLinkHeaderSize> kPlainHere{kLinkMagic & 0xFF, kLinkMagic >> 8, 0, 0};
inline constexpr std::array<std::uint8_t, 15> kEncryptedHere{21, 0xFE, 0xFD, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 10};

class OtherVersion {
 public:
  /// The receiving thread, with every datagram.
  void note(std::span<const std::uint8_t> datagram) noexcept {
    ByteReader in(datagram);
    const bool ours = in.get<std::uint16_t>() == kLinkMagic;
    const auto version = in.get<std::uint8_t>();
    if (!ours || !in.ok() || version == kLinkVersion || version == 0) return;  // 0: kPlainHere, which has none
    heard_.store(version, std::memory_order_relaxed);
    at_.store(Clock::now().time_since_epoch().count(), std::memory_order_relaxed);
  }
  /// Within the last 5 s; 0: none. Any thread.
  [[nodiscard]] std::uint8_t heard() const noexcept {
    const Clock::time_point at{Clock::duration(at_.load(std::memory_order_relaxed))};
    return Clock::now() - at < std::chrono::seconds(5) ? heard_.load(std::memory_order_relaxed) : std::uint8_t{0};
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::atomic<std::uint8_t> heard_{0};
  std::atomic<Clock::rep> at_{0};  // since the clock's epoch
};

}  // namespace knuckle
