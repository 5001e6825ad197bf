// The machine's wire: classic CAN frames. One of the three places with inheritance (CAN, HID, link).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace knuckle {

/// Set in an identifier of 29 bits (ISO 11898-1: extended), as SocketCAN and DBC files have it.
inline constexpr std::uint32_t kExtendedId = 0x8000'0000;
/// Set in the identifiers of the second of two buses, inside the program alone: CanBuses adds it and takes it off.
inline constexpr std::uint32_t kSecondBus = 0x2000'0000;
inline constexpr std::uint32_t kMostId = 0x7FF, kMostExtendedId = 0x1FFF'FFFF;

/// Identifiers that agree in the bits of the mask; by itself one identifier.
struct CanFilter {
  static constexpr std::uint32_t kWhole = kExtendedId | kSecondBus | kMostExtendedId;
  std::uint32_t id, mask;
  constexpr CanFilter(std::uint32_t with_id, std::uint32_t with_mask = kWhole) noexcept
      : id(with_id), mask(with_mask) {}
  [[nodiscard]] constexpr bool lets(std::uint32_t other) const noexcept { return ((id ^ other) & mask) == 0; }
  bool operator==(const CanFilter&) const = default;
};

struct CanFrame {
  std::uint32_t id = 0;   ///< 11 bits; with kExtendedId 29; with kSecondBus likewise.
  std::uint8_t size = 0;  ///< 0..8
  std::array<std::uint8_t, 8> data{};
  bool operator==(const CanFrame&) const = default;
};

/// More are left for the next step: a babbling node cannot keep a loop busy.
inline constexpr int kMostFramesPerStep = 256;

enum class CanState : std::uint8_t { kActive, kPassive, kBusOff, kDown };
[[nodiscard]] constexpr unsigned number_of_words(CanState) noexcept {
  return static_cast<unsigned>(CanState::kDown) + 1;
}
/// In words, for people.
[[nodiscard]] constexpr const char* name(CanState state) noexcept {
  constexpr std::array kNames{"sound", "error-passive", "bus-off", "down"};
  static_assert(kNames.size() == number_of_words(CanState{}));
  return kNames[static_cast<std::size_t>(state)];
}

class CanBus {
 public:
  virtual ~CanBus() = default;
  /// Hands a frame to the controller. Never blocks; false where it was dropped (queue full, bus off): the caller
  /// must not retry a stale set-point, only send a newer one.
  virtual bool send(const CanFrame& frame) noexcept = 0;
  /// The next received frame, oldest first; false where there is none. Never blocks.
  virtual bool receive(CanFrame& frame) noexcept = 0;
  /// Of two buses that of the worse one.
  [[nodiscard]] virtual CanState state() const noexcept = 0;
  /// Of each of two buses, as state() found it the last time; kActive where there is no second. A bus alone is asked.
  [[nodiscard]] virtual std::array<CanState, 2> states() const noexcept { return {state(), CanState::kActive}; }
  /// Which of them state() was of: 0 or 1.
  [[nodiscard]] std::uint8_t state_of() const noexcept {
    const std::array<CanState, 2> each = states();
    return each[1] > each[0] ? 1 : 0;
  }
  /// An operator has taken note of what happened to the bus and wants to go on: a bus-off that is over, kept until
  /// then, is forgotten.
  virtual void acknowledge() noexcept {}
  /// Error frames heard and frames lost on the way, both ways, since it was opened.
  [[nodiscard]] virtual std::uint64_t errors() const noexcept { return 0; }
};

}  // namespace knuckle
