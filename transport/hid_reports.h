// Reports of the haptic device (vendor page 0xFF00, little-endian, 1 kHz) and every bit in them.
// CRC-16/CCITT-FALSE over all preceding bytes, report number included, in the last two bytes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "transport/hid_port.h"

namespace knuckle {

// How the device is found. 0x1209:0x0001 is the test number of pid.codes: a product needs one of its own.
inline constexpr std::uint16_t kHidVendor = 0x1209, kHidProduct = 0x0001;
inline constexpr std::uint16_t kHidUsagePage = 0xFF00;
inline constexpr const char* kHidUsbId = "1209:0001";

/// Report descriptor: one vendor-page collection of opaque 64-byte reports, 1 and 3 in, 2 and 4 out.
inline constexpr std::array<std::uint8_t, 41> kHidReportDescriptor{
    0x06, 0x00, 0xFF,                    // usage page 0xFF00
    0x09, 0x01,                          // usage 1
    0xA1, 0x01,                          // application collection
    0x15, 0x00,                          //   logical minimum 0
    0x26, 0xFF, 0x00,                    //   logical maximum 255
    0x75, 0x08,                          //   report size 8 bits
    0x95, 0x3F,                          //   report count 63, and the number in front
    0x85, 0x01, 0x09, 0x01, 0x81, 0x02,  // report 1: input
    0x85, 0x03, 0x09, 0x03, 0x81, 0x02,  // report 3: input
    0x85, 0x02, 0x09, 0x02, 0x91, 0x02,  // report 2: output
    0x85, 0x04, 0x09, 0x04, 0x91, 0x02,  // report 4: output
    0xC0};

inline constexpr std::uint8_t kHidVersion = 1;
inline constexpr std::uint8_t kReportState = 0x01;        ///< IN
inline constexpr std::uint8_t kReportTorque = 0x02;       ///< OUT
inline constexpr std::uint8_t kReportDescription = 0x03;  ///< IN, answers kReportDescribe
inline constexpr std::uint8_t kReportDescribe = 0x04;     ///< OUT

/// Bits of DeviceState::status.
enum DeviceStatus : std::uint16_t {
  kDevicePresence = 1 << 0,  ///< hand sensor
  kDeviceEnable = 1 << 1,    ///< dead-man button
  kDeviceClutch = 1 << 2,    ///< indexing button
  kDeviceStop = 1 << 3,      ///< stop button
  kDeviceTorqueOn = 1 << 4,  ///< motors are driven as asked: not without their supply
  kDeviceLatched = 1 << 5,   ///< torque off after a watchdog or bad report, until mode 0 was sent
};
inline constexpr unsigned kDeviceStatusBits = 0x3F;  ///< All of them; others are refused.
/// Bits of DeviceState::fault.
enum DeviceFault : std::uint16_t {
  kDeviceFaultWatchdog = 1 << 0,
  kDeviceFaultCrc = 1 << 1,
  kDeviceFaultSequence = 1 << 2,
  kDeviceFaultOvertemperature = 1 << 3,
  kDeviceFaultOvercurrent = 1 << 4,
  kDeviceFaultEncoder = 1 << 5,
};
inline constexpr unsigned kDeviceFaultBits = 0x3F;
enum class TorqueMode : std::uint8_t { kOff = 0, kDamp = 1, kTorque = 2 };

/// IN 0x01. Arrays in joint order boom (forearm), arm (wrist), bucket (finger).
struct DeviceState {
  std::uint16_t sequence = 0;
  std::uint32_t device_time_us = 0;
  PerJoint<std::int32_t> counts{};
  PerJoint<std::int32_t> counts_per_s{};
  PerJoint<std::int16_t> current_mA{};
  std::uint16_t status = 0;
  std::uint16_t fault = 0;
  std::uint16_t last_command_sequence = 0;
  std::uint16_t bus_mV = 0;
  std::int16_t temperature_dC = 0;  ///< 0.1 degC
};

/// OUT 0x02.
struct DeviceCommand {
  std::uint16_t sequence = 0;
  TorqueMode mode = TorqueMode::kOff;
  std::uint8_t flags = 0;
  PerJoint<std::int16_t> torque_permille{};  ///< Of rated torque; positive drives the motor's counts up.
  PerJoint<std::uint16_t> limit_permille{};
  std::uint16_t watchdog_ms = 20;
  std::uint16_t echoed_sequence = 0;  ///< sequence of the newest DeviceState
};

/// IN 0x03: what the device says of itself.
struct DeviceIdentity {
  PerJoint<std::uint32_t> counts_per_turn{};  ///< at the motor
  PerJoint<float> gear_ratio{};
  PerJoint<float> torque_constant_Nm_per_A{};  ///< at the motor
  PerJoint<std::uint16_t> rated_current_mA{};
  PerJoint<std::int8_t> joint_sign{};
  PerJoint<std::int32_t> zero_counts{};  ///< counts where the joint angle is zero
  std::uint32_t serial = 0;
};

[[nodiscard]] std::uint16_t crc16_ccitt_false(const std::uint8_t* data, std::size_t size) noexcept;

[[nodiscard]] HidReport encode(const DeviceState& state) noexcept;
[[nodiscard]] HidReport encode(const DeviceCommand& command) noexcept;
[[nodiscard]] HidReport encode(const DeviceIdentity& identity) noexcept;
[[nodiscard]] HidReport encode_describe_request() noexcept;
/// nullopt where number, version or CRC is wrong.
[[nodiscard]] std::optional<DeviceState> decode_state(const HidReport& report) noexcept;
[[nodiscard]] std::optional<DeviceCommand> decode_command(const HidReport& report) noexcept;
[[nodiscard]] std::optional<DeviceIdentity> decode_identity(const HidReport& report) noexcept;
[[nodiscard]] bool is_describe_request(const HidReport& report) noexcept;

}  // namespace knuckle
