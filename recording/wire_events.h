// What crosses the three wires in one step of a loop, as it is recorded: every answer that the loop got from a wire,
// and everything that it gave to one. Fed with the answers again, the loop does the same again.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle::recording {

// Datagrams of the link's versions before this one, in the recordings of their time.

/// Recordings of links from this version on are read.
inline constexpr int kOldestLinkVersion = 7;

struct TranslatedDatagram {
  std::vector<std::uint8_t> bytes;  ///< As this version would have sent it.
  bool led_by_waves = false;        ///< A set-point that was not followed as it is, but by the waves beside it.
  std::size_t made_up = 0;          ///< Bytes at the end for what that version did not tell: zeros.
};

/// Of version 7, which had an energy and wave variables at the end of both sides' messages, 8, which told no torque
/// about the tip, and 9, which knew no way home on two.
/// @return nullopt where it is no datagram that its version took.
[[nodiscard]] std::optional<TranslatedDatagram> from_older_link(std::span<const std::uint8_t> datagram);

enum class WireEventKind : std::uint8_t {
  kCanReceived,      ///< value: identifier, with kSecondBus of the second of two; data: 0 to 8 bytes
  kCanSent,          ///< likewise
  kCanRefused,       ///< likewise; send() said false
  kCanState,         ///< value: CanState, asked for; can_states()
  kCanAcknowledged,  ///< an operator has taken note of a bus-off
  kHidReceived,      ///< data: 64 bytes
  kHidSent,          ///< likewise
  kHidRefused,       ///< likewise; write() said false
  kHidConnected,     ///< value: 1 or 0 as it is from now on
  kLinkReceived,     ///< value: ns that it had waited at this computer; data: the datagram
  kLinkSent,         ///< data: the datagram
  kLinkRefused,      ///< likewise; send() said false
  kLinkNotEmptied,   ///< value: 1: reading the link gave up before it had seen all; 0: no longer
  kCount,
};
[[nodiscard]] const char* name(WireEventKind kind) noexcept;

// Of kCanState: the worse of two buses' states, from kStateOfBit on whose it is, from kOtherStateBit on the other's;
// recordings of link version 10 and before do not tell that, and lack kBothToldBit.
inline constexpr unsigned kStateOfBit = 8, kOtherStateBit = 16, kBothToldBit = 24;
/// What is no state in a damaged recording is "down".
[[nodiscard]] constexpr CanState can_state(std::uint32_t value) noexcept {
  return static_cast<CanState>(std::min(value & 0xFFU, static_cast<std::uint32_t>(CanState::kDown)));
}
[[nodiscard]] constexpr std::uint8_t can_state_of(std::uint32_t value) noexcept {
  return static_cast<std::uint8_t>(value >> kStateOfBit & 1U);
}
/// Of each bus.
[[nodiscard]] constexpr std::array<CanState, 2> can_states(std::uint32_t value) noexcept {
  const CanState worse = can_state(value), other = can_state(value >> kOtherStateBit);
  return can_state_of(value) == 0 ? std::array{worse, other} : std::array{other, worse};
}
[[nodiscard]] constexpr std::uint32_t can_states_value(const std::array<CanState, 2>& states) noexcept {
  const unsigned of = states[1] > states[0] ? 1 : 0;
  return static_cast<std::uint32_t>(states[of]) | of << kStateOfBit |
         static_cast<std::uint32_t>(states[1 - of]) << kOtherStateBit | 1U << kBothToldBit;
}
[[nodiscard]] constexpr bool both_told(std::uint32_t value) noexcept {
  return (value >> kBothToldBit & 1U) != 0;
}

/// In the message's own memory, or that of its StepWires.
struct WireEvent {
  WireEventKind kind{};
  std::uint32_t value = 0;
  std::span<const std::uint8_t> data;
  std::size_t made_up = 0;  ///< Of a datagram of an older link (TranslatedDatagram): not compared.
};

/// All events of one step of one loop.
struct StepWires {
  Time at{};
  std::uint32_t step = 0;     ///< Counts the loop's steps from 0: a gap is a step that is not in the recording.
  std::uint32_t crc = 0;      ///< CRC-32 of the events as they were recorded.
  std::uint32_t lost = 0;     ///< Events of this step for which there was no room.
  bool intact = false;        ///< The events are those that the CRC was made of.
  bool led_by_waves = false;  ///< A set-point that was received was led by the law "wave", which is no more.
  std::vector<WireEvent> events;
  std::shared_ptr<std::vector<std::vector<std::uint8_t>>> translated;  ///< Datagrams of an older link.
};

/// ROS 2's definition of knuckle_msgs/Wires.
[[nodiscard]] std::string wires_schema();
/// @return nullopt where the message is not one of these. @param message must outlive the result.
/// @param link_version of the recording (its head): datagrams of an older one are given as today's would be sent.
[[nodiscard]] std::optional<StepWires> decode_wires(std::span<const std::uint8_t> message, int link_version);

/// The frame of an event of the CAN wire.
[[nodiscard]] CanFrame can_frame(const WireEvent& event) noexcept;

}  // namespace knuckle::recording
