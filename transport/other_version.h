// Whether a far end's messages are of another version of the link, so that this end can say so. On a plain link anybody
// can send such messages: they word a line and decide nothing.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>

#include "transport/link_header.h"

namespace knuckle {

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
