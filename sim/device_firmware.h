// Firmware of the simulated haptic device: speaks HID reports over its end of the cable, drives motor currents as the
// newest command asks, and takes torque away by itself when commands are missing, repeated or damaged.
#pragma once

#include <array>
#include <cstdint>

#include "core/joints.h"
#include "core/time.h"
#include "machine/device_description.h"
#include "transport/hid_port.h"
#include "transport/hid_reports.h"

namespace knuckle::sim {

/// What the firmware's own hardware tells it.
struct DeviceSensors {
  PerJoint<std::int32_t> counts{};
  PerJoint<double> current_A{};
  PerJoint<double> heat{};  ///< Motor heat, 1 = what rated current holds for ever.
  bool presence = false, enable = false, clutch = false, stop = false;
};

/// What can be broken on purpose.
enum class FirmwareFault : std::uint8_t {
  kNone,
  kSilent,      ///< no state reports; commands still obeyed
  kBadCrc,      ///< state reports damaged on the way
  kFrozen,      ///< the same state report over and over
  kWildCounts,  ///< encoder counts stand for no angle (smallest integer)
  kUnpowered,   ///< the motors' supply is off; all else works
  kTruncated,   ///< of every report the end is not sent, and reads as zeros
  kHung,        ///< neither reports nor reads; the motor stage's own watchdog takes the torque away
};

class DeviceFirmware {
 public:
  DeviceFirmware(const DeviceDescription& device, HidPort& cable, std::uint32_t serial) noexcept;

  /// Tracks speed from counts; called faster than reports go out (encoder interrupt).
  void track(const PerJoint<std::int32_t>& counts, double dt_s) noexcept;
  /// One firmware cycle, every millisecond: reads commands, then sends one state report.
  /// @return current to drive through each motor [A], in the direction of rising counts.
  [[nodiscard]] PerJoint<double> step(Time now, const DeviceSensors& sensors) noexcept;

  void inject(FirmwareFault fault) noexcept { injected_ = fault; }
  [[nodiscard]] bool latched() const noexcept { return latched_; }
  [[nodiscard]] std::uint16_t fault() const noexcept { return fault_; }

 private:
  void read_commands(Time now) noexcept;
  void obey(Time now, const DeviceCommand& command) noexcept;
  void latch(std::uint16_t fault) noexcept;
  void write(HidReport report) noexcept;
  void send_state(Time now, const DeviceSensors& sensors) noexcept;
  [[nodiscard]] PerJoint<double> drive() noexcept;

  DeviceDescription device_;
  HidPort& cable_;
  std::uint32_t serial_;
  FirmwareFault injected_ = FirmwareFault::kNone;

  PerJoint<double> tracked_counts_{}, tracked_rate_{};  // speed observer [counts, counts/s]
  bool tracking_ = false;

  TorqueMode mode_ = TorqueMode::kOff;
  PerJoint<double> asked_A_{};  // of the newest good command
  PerJoint<double> applied_A_{};
  PerJoint<double> released_A_{};  // applied when torque was taken away: ramps to zero from here
  double torque_share_ = 0;        // of released_A_ left
  double damp_share_ = 0;          // of damping faded in
  bool latched_ = false;
  std::uint16_t fault_ = 0;
  bool commanded_ = false;  // a command came since the last mode 0 and the last silence: its sequence counts
  std::uint16_t command_sequence_ = 0;
  Time command_at_ = kNever;
  Duration watchdog_{};
  std::uint16_t sequence_ = 0;
  HidReport last_report_{};
};

}  // namespace knuckle::sim
