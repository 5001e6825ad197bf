// SAE J1939 as far as a listener needs it: parameter groups in identifiers (J1939-21), requests for them, and address
// claims (J1939-81).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle::j1939 {

inline constexpr std::uint32_t kMostGroup = 0x1'FFFF;  ///< With its data page.
inline constexpr std::uint8_t kMostAddress = 0xFD, kNoAddress = 0xFE, kEverybody = 0xFF;
inline constexpr std::uint32_t kRequest = 0xEA00, kAddressClaim = 0xEE00;
/// ISO 11783-7: commands of auxiliary valves 0 to 15.
inline constexpr std::uint32_t kValveCommand = 0xFE30, kMostValve = 15;

/// PDU1: the identifier has the receiver's address in place of the group's last byte, which is 0.
[[nodiscard]] constexpr bool has_destination(std::uint32_t group) noexcept {
  return (group >> 8 & 0xFFU) < 0xF0;
}
/// What identifiers of a group have in common: neither priority nor the addresses of sender and receiver.
[[nodiscard]] constexpr std::uint32_t group_mask(std::uint32_t group) noexcept {
  return kExtendedId | kSecondBus | (has_destination(group) ? 0x03FF'0000U : 0x03FF'FF00U);
}
/// Of the same group to the same receiver.
inline constexpr std::uint32_t kAllButPriorityAndSource = kExtendedId | kSecondBus | 0x03FF'FF00U;

/// @param destination of a group that has one. @param priority 0 goes first, 7 last
[[nodiscard]] constexpr std::uint32_t identifier(std::uint32_t group, std::uint8_t source,
                                                 std::uint8_t destination = kEverybody,
                                                 std::uint32_t priority = 6) noexcept {
  const std::uint32_t to = has_destination(group) ? std::uint32_t{destination} << 8 : 0U;
  return kExtendedId | priority << 26 | group << 8 | to | source;
}
[[nodiscard]] constexpr std::uint32_t group_of(std::uint32_t id) noexcept {
  const std::uint32_t group = id >> 8 & kMostGroup;
  return has_destination(group) ? group & ~0xFFU : group;
}
[[nodiscard]] constexpr std::uint8_t source_of(std::uint32_t id) noexcept {
  return static_cast<std::uint8_t>(id);
}
[[nodiscard]] constexpr bool is_of(std::uint32_t group, std::uint32_t id) noexcept {
  return CanFilter(identifier(group, 0), group_mask(group)).lets(id);
}
/// Whether a frame of a group that has a receiver is for this address.
[[nodiscard]] constexpr bool is_for(std::uint8_t address, std::uint32_t id) noexcept {
  const auto destination = static_cast<std::uint8_t>(id >> 8);
  return destination == address || destination == kEverybody;
}

// Messages of more than 8 bytes (transport/j1939_packets.h).
inline constexpr std::uint32_t kConnection = 0xEC00, kTransfer = 0xEB00;  ///< TP.CM, TP.DT
inline constexpr unsigned kPacketBytes = 7;
inline constexpr unsigned kMostMessage = 255;    ///< Bytes that are kept; of a longer one the first.
inline constexpr Duration kPacketsApart = 50ms;  ///< No packet comes sooner; at most 200 ms.
/// Whether a message of so many bytes does not fit into a frame.
[[nodiscard]] constexpr bool in_packets(std::size_t bytes) noexcept {
  return bytes > sizeof(CanFrame::data);
}
[[nodiscard]] constexpr unsigned packets_of(unsigned bytes) noexcept {
  return (bytes + kPacketBytes - 1) / kPacketBytes;
}

[[nodiscard]] CanFrame request_frame(std::uint32_t group, std::uint8_t source, std::uint8_t destination) noexcept;
/// The group that a frame asks for; nullopt where it asks for none.
[[nodiscard]] std::optional<std::uint32_t> requested(const CanFrame& frame) noexcept;

/// @param source kNoAddress: it cannot claim one.
[[nodiscard]] CanFrame claim_frame(std::uint64_t name, std::uint8_t source) noexcept;
/// The NAME that a frame claims its source address for, or has none; nullopt where it is no claim.
[[nodiscard]] std::optional<std::uint64_t> claimed_name(const CanFrame& frame) noexcept;

/// The first raw value of a length that is none: an error, not available, or reserved (J1939-71). nullopt where the
/// standard says none.
[[nodiscard]] constexpr std::optional<std::uint64_t> invalid_from(unsigned bits) noexcept {
  if (bits == 2) return 2;
  if (bits == 4) return 0xE;
  if (bits >= 8 && bits <= 64) return std::uint64_t{0xFB} << (bits - 8);
  return std::nullopt;
}

}  // namespace knuckle::j1939
