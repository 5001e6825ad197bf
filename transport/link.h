// The wire between operator and machine: datagrams that may be lost, late, doubled or out of order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/time.h"

namespace knuckle {

inline constexpr std::size_t kMaxDatagram = 1200;  ///< Fits one MTU with every header.

struct Datagram {
  std::uint16_t size = 0;
  Duration waited{};  ///< At this computer, before it was received here.
  std::array<std::uint8_t, kMaxDatagram> bytes{};
  [[nodiscard]] std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), size}; }
};

class Link {
 public:
  virtual ~Link() = default;
  /// Sends at most kMaxDatagram bytes; never blocks. False where it was not sent.
  virtual bool send(std::span<const std::uint8_t> bytes) noexcept = 0;
  /// The next datagram that has arrived; false where there is none. Never blocks.
  virtual bool receive(Datagram& datagram) noexcept = 0;
  /// Of the last receive() that gave nothing: nothing more had arrived. False where it gave up before it had seen all.
  [[nodiscard]] virtual bool emptied() const noexcept { return true; }
};

}  // namespace knuckle
