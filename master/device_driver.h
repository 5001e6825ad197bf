// The haptic device as the master sees it: describe handshake, newest report with its age, angles and speeds, buttons,
// and torque commands out. Every doubt about the device ends in a Reason and in "off".
#pragma once

#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/device_description.h"
#include "transport/hid_port.h"
#include "transport/hid_reports.h"

namespace knuckle::master {

/// The device now. Angles, speeds and buttons are those of the newest good report; buttons read as released and
/// presence as absent while not ok.
struct DeviceReading {
  bool ok = false;
  Reason reason;                                 ///< Why not ok.
  JointVector joint_rad = JointVector::Zero();   ///< Machine-like joint angles.
  JointVector rate_radps = JointVector::Zero();  ///< As the firmware tracks them, not filtered further.
  bool presence = false, enable = false, clutch = false, stop = false;
  Time measured_at = kNever;      ///< When the report was made, on the master's clock.
  std::uint32_t attachments = 0;  ///< Grows each time the device is (re)attached: alignment is lost then.
};

struct DeviceCounters {
  std::uint64_t reports = 0, damaged = 0, implausible = 0, missed = 0, discarded_old = 0;
};

class DeviceDriver {
 public:
  DeviceDriver(const DeviceDescription& device, HidPort& port) noexcept;

  /// Drains the port to the newest report; call every millisecond.
  const DeviceReading& step(Time now) noexcept;
  /// Sends joint torques, or mode off while the device is not ok (which also clears the firmware's latch) or once it
  /// was released. A device that drives no motor is asked on for no torque: it shows when it can again.
  void command(const JointVector& torque_Nm) noexcept;
  /// From now on every command says "off".
  void let_go() noexcept { let_go_ = true; }

  [[nodiscard]] const DeviceReading& reading() const noexcept { return reading_; }
  [[nodiscard]] const DeviceCounters& counters() const noexcept { return counters_; }

 private:
  void attach(Time now) noexcept;
  void detach() noexcept;
  void drain(Time now) noexcept;
  void check_identity(const DeviceIdentity& identity) noexcept;
  /// Age of a report by the device's own clock, against the quickest report seen lately.
  [[nodiscard]] Duration age_of(const DeviceState& state, Time now) noexcept;
  void take(const DeviceState& state, Duration age, Time now) noexcept;
  [[nodiscard]] bool plausible(const JointVector& joint_rad, const JointVector& rate_radps,
                               Time measured_at) const noexcept;
  [[nodiscard]] Reason judge(Time now) const noexcept;

  DeviceDescription device_;
  HidPort& port_;
  JointVector rad_per_count_, permille_per_Nm_;
  bool calibrated_;  // the file's signs and zeros were measured on this very device
  DeviceReading reading_;
  DeviceCounters counters_;

  bool attached_ = false;
  std::optional<DeviceIdentity> identity_;  // of the attached device, agreeing with the file
  bool wrong_device_ = false;
  std::uint32_t serial_ = 0;  // of the file, or of the first device attached: only this one may come back
  Time described_at_ = kNever;

  bool reported_ = false;  // a good report came since attaching
  DeviceState newest_;
  std::uint16_t buttons_ = 0;
  bool enable_seen_released_ = false;  // since the device was last not ok
  std::uint32_t last_device_us_ = 0;
  Duration device_time_{}, quickest_{};  // device clock unwrapped; least (arrival - device time) lately
  int bad_in_a_row_ = 0;
  Time bad_since_ = kNever;  // newest moment the device was not ok
  std::uint16_t command_sequence_ = 0;
  Time stepped_at_ = kNever, attached_at_ = kNever;
  Time asked_since_ = kNever;  // torque mode, in every command since
  bool let_go_ = false;
};

}  // namespace knuckle::master
