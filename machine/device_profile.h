// CiA's device profiles, as far as the machine's nodes have them, and the numbers by which devices say which is theirs.
#pragma once

#include <array>
#include <cstdint>

#include "machine/bus_description.h"

namespace knuckle {

struct DeviceProfile {
  std::uint16_t number;  ///< CiA's.
  NodeRole role;
  const char* devices;  ///< What they are.
};
inline constexpr std::array kDeviceProfiles{DeviceProfile{408, NodeRole::kValve, "hydraulic valve"},
                                            DeviceProfile{404, NodeRole::kPressure, "measuring device"},
                                            DeviceProfile{406, NodeRole::kEncoder, "encoder"},
                                            DeviceProfile{410, NodeRole::kTilt, "inclinometer"},
                                            DeviceProfile{401, NodeRole::kEnable, "inputs and outputs"},
                                            DeviceProfile{401, NodeRole::kModule, "inputs and outputs"}};

/// The profile's number in a device type (object 0x1000): its lower 16 bits. 0: the device keeps to none.
[[nodiscard]] constexpr std::uint16_t profile_number(std::uint32_t device_type) noexcept {
  return static_cast<std::uint16_t>(device_type & 0xFFFFU);
}
[[nodiscard]] constexpr std::uint16_t profile_number(NodeRole role) noexcept {
  for (const DeviceProfile& one : kDeviceProfiles)
    if (one.role == role) return one.number;
  return 0;
}
/// Whether a device of this type may have what nodes of this role have. Of several devices in one housing (upper 16
/// bits 0xFFFF, CiA 301) the number is the first one's; without a profile nothing is said. 0xFFFFFFFF is no type.
[[nodiscard]] constexpr bool may_be(std::uint32_t device_type, NodeRole role) noexcept {
  const std::uint16_t number = profile_number(device_type);
  return number == profile_number(role) || number == 0 || (device_type >> 16 == 0xFFFFU && number != 0xFFFFU);
}

}  // namespace knuckle
