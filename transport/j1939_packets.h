// Messages of more than 8 bytes in J1939 as far as they are for everybody: announced (BAM), then sent in packets of 7
// bytes each (J1939-21, transport protocol). Those that two devices agree on between them are none of a listener's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/time.h"
#include "transport/can_bus.h"
#include "transport/j1939.h"

namespace knuckle::j1939 {

inline constexpr unsigned kLeastMessage = 9, kMostPackets = 255;
inline constexpr Duration kPacketWaits = 750ms;  ///< T1: no packet comes later than that.

/// A message that is to come.
struct Announcement {
  std::uint32_t group = 0;
  std::uint16_t bytes = 0;
  std::uint8_t packets = 0;
  bool operator==(const Announcement&) const = default;
};
/// nullopt where the frame announces nothing to everybody, or what cannot be: bytes and packets that do not fit.
[[nodiscard]] std::optional<Announcement> announced(const CanFrame& frame) noexcept;
/// The number of the packet that a frame is, from 1; nullopt where it is none for everybody.
[[nodiscard]] std::optional<std::uint8_t> packet_number(const CanFrame& frame) noexcept;

[[nodiscard]] CanFrame announcement_frame(std::uint32_t group, std::uint8_t source, std::size_t bytes) noexcept;
/// @param number from 1 to packets_of(). What the last one has too many is 0xFF.
[[nodiscard]] CanFrame packet_frame(std::uint8_t source, std::uint8_t number,
                                    std::span<const std::uint8_t> message) noexcept;

/// Puts one sender's messages of one group together.
class PacketReader {
 public:
  /// What a frame made of the message before it.
  struct Lost {
    std::uint8_t packet = 0, of = 0;
  };

  void begin(const Announcement& announcement, Time now) noexcept;
  /// The next packet. One that is not the next ends the message. @return what was lost by it
  std::optional<Lost> add(std::uint8_t number, const CanFrame& frame, Time now) noexcept;
  /// Ends a message that is under way. @return what was lost by it
  std::optional<Lost> end() noexcept;
  /// Ends a message whose next packet does not come.
  std::optional<Lost> step(Time now) noexcept { return late(now) ? end() : std::nullopt; }

  [[nodiscard]] bool under_way() const noexcept { return next_ != 0; }
  /// The message, once add() has its last packet and until the next begins; else empty.
  [[nodiscard]] std::span<const std::uint8_t> message() const noexcept { return {data_.data(), whole_}; }

 private:
  [[nodiscard]] bool late(Time now) const noexcept { return under_way() && now - newest_at_ > kPacketWaits; }

  std::array<std::uint8_t, kMostMessage> data_{};
  std::size_t whole_ = 0;
  std::uint16_t bytes_ = 0;
  std::uint8_t packets_ = 0, next_ = 0;  // 0: none is under way
  Time newest_at_ = kNever;
};

}  // namespace knuckle::j1939
