// Layer setting services (LSS, CiA 305): how a CANopen device is given its node id over the bus, found by its identity.
// Frames of both ends; no state and no time in here.
#pragma once

#include <cstdint>
#include <optional>

#include "transport/can_bus.h"

namespace knuckle::lss {

inline constexpr std::uint32_t kRequestId = 0x7E5, kAnswerId = 0x7E4;
inline constexpr std::uint8_t kNoNodeId = 0xFF;  ///< Of a device that was given none: it answers LSS and nothing else.

/// Object 0x1018: no two devices have the same.
struct Identity {
  std::uint32_t vendor = 0, product = 0, revision = 0, serial = 0;
  bool operator==(const Identity&) const = default;
};

enum class State : std::uint8_t { kWaiting = 0, kConfiguration = 1 };

/// What a message asks or answers, and what its value is.
enum class Service : std::uint8_t {
  kSwitchAll = 0x04,        ///< State of every device; nobody answers.
  kConfigureNodeId = 0x11,  ///< The node id. Answer: an error code.
  kStore = 0x17,            ///< Answer: an error code.
  // Four in a row name one device, which answers kSelected and is in configuration from then on.
  kSelectVendor = 0x40,
  kSelectProduct = 0x41,
  kSelectRevision = 0x42,
  kSelectSerial = 0x43,
  kSelected = 0x44,
  // Six in a row: every device within these bounds answers kIdentified.
  kIdentifyVendor = 0x46,
  kIdentifyProduct = 0x47,
  kIdentifyRevisionLow = 0x48,
  kIdentifyRevisionHigh = 0x49,
  kIdentifySerialLow = 0x4A,
  kIdentifySerialHigh = 0x4B,
  kIdentifyUnconfigured = 0x4C,  ///< Every device without a node id answers kUnconfigured.
  kIdentified = 0x4F,
  kUnconfigured = 0x50,
  // Of the devices in configuration; the answer has the same service and the value.
  kAskVendor = 0x5A,
  kAskProduct = 0x5B,
  kAskRevision = 0x5C,
  kAskSerial = 0x5D,
  kAskNodeId = 0x5E,  ///< kNoNodeId where it has none.
};

struct Message {
  Service service = Service::kSwitchAll;
  std::uint32_t value = 0;
  bool operator==(const Message&) const = default;
  /// Its first byte: of an answer to kConfigureNodeId or kStore an error, 0 where it was done; else a node id.
  [[nodiscard]] std::uint8_t code() const noexcept { return static_cast<std::uint8_t>(value & 0xFFU); }
};

[[nodiscard]] CanFrame request(Service service, std::uint32_t value = 0) noexcept;
[[nodiscard]] CanFrame answer(Service service, std::uint32_t value = 0) noexcept;
/// nullopt where it is none, or one of a service that is not above (bit timing, fast scan).
[[nodiscard]] std::optional<Message> parse_request(const CanFrame& frame) noexcept;
[[nodiscard]] std::optional<Message> parse_answer(const CanFrame& frame) noexcept;

/// Of a service that is answered with an error code, and a code that is not 0.
[[nodiscard]] const char* error_text(Service service, std::uint8_t error) noexcept;

}  // namespace knuckle::lss
