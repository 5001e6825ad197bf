// Firmware of the simulated haptic device.
#include "sim/device_firmware.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace knuckle::sim {
namespace {

constexpr double kTrackingHz = 150;  // speed observer: quick enough for 60 N s/m at the hand, 1 count ~ 1 mm/s
constexpr double kTick_s = 1e-3;
constexpr double kReleaseTime_s = 25e-3;  // torque taken away at 0.32 N/ms from 8 N: never a kick
constexpr double kDampFadeIn_s = 50e-3;
constexpr double kDampTime_s = 0.05;        // damping stops the bare rotors and links with this time constant
constexpr std::size_t kTruncatedSize = 20;  // in the middle of the counts
constexpr double kHeatTrip = 1.25;          // of what rated current holds for ever

std::int32_t to_i32(double value) noexcept {
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  return std::int32_t(std::clamp(std::round(value), -kMax, kMax));
}
std::int16_t to_i16(double value) noexcept {
  return std::int16_t(std::clamp(std::round(value), -32767.0, 32767.0));
}

}  // namespace

DeviceFirmware::DeviceFirmware(const DeviceDescription& device, HidPort& cable, std::uint32_t serial) noexcept
    : device_(device), cable_(cable), serial_(serial), watchdog_(from_seconds(device.watchdog_s)) {}

void DeviceFirmware::track(const PerJoint<std::int32_t>& counts, double dt_s) noexcept {
  constexpr double kOmega = 2 * std::numbers::pi * kTrackingHz;
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (!tracking_) tracked_counts_[i] = counts[i];
    const double predicted = tracked_counts_[i] + dt_s * tracked_rate_[i];
    const double error = counts[i] - predicted;
    tracked_counts_[i] = predicted + 1.4 * kOmega * dt_s * error;
    tracked_rate_[i] += kOmega * kOmega * dt_s * error;
  }
  tracking_ = true;
}

PerJoint<double> DeviceFirmware::step(Time now, const DeviceSensors& sensors) noexcept {
  if (injected_ != FirmwareFault::kHung) read_commands(now);
  if (mode_ != TorqueMode::kOff && now - command_at_ > watchdog_) {
    latch(kDeviceFaultWatchdog);
    commanded_ = false;  // a program that starts anew counts anew; the latch still wants its mode 0
  }
  if (std::ranges::any_of(sensors.heat, [](double heat) { return heat > kHeatTrip; })) {
    latch(kDeviceFaultOvertemperature);
  }
  const PerJoint<double> current_A = injected_ == FirmwareFault::kUnpowered ? applied_A_ = {} : drive();
  if (injected_ != FirmwareFault::kHung && injected_ != FirmwareFault::kSilent) send_state(now, sensors);
  return current_A;
}

void DeviceFirmware::read_commands(Time now) noexcept {
  HidReport report;
  while (cable_.read(report)) {
    if (is_describe_request(report)) {
      DeviceIdentity identity;
      identity.counts_per_turn = device_.counts_per_turn;
      identity.zero_counts = device_.zero_counts;
      for (std::size_t i = 0; i < kJoints; ++i) {
        identity.gear_ratio[i] = float(device_.gear_ratio[i]);
        identity.torque_constant_Nm_per_A[i] = float(device_.torque_constant_Nm_per_A[i]);
        identity.rated_current_mA[i] = std::uint16_t(std::lround(device_.rated_current_A[i] * 1e3));
        identity.joint_sign[i] = std::int8_t(device_.joint_sign[i]);
      }
      identity.serial = serial_;
      write(encode(identity));
    } else if (const auto command = decode_command(report)) {
      obey(now, *command);
    } else {
      latch(kDeviceFaultCrc);
    }
  }
}

void DeviceFirmware::obey(Time now, const DeviceCommand& command) noexcept {
  if (commanded_ && std::int16_t(command.sequence - command_sequence_) <= 0) return latch(kDeviceFaultSequence);
  command_sequence_ = command.sequence;
  command_at_ = now;
  commanded_ = true;
  if (command.mode == TorqueMode::kOff) {  // the only way out of a latch
    latched_ = commanded_ = false;
    fault_ = 0;
  }
  if (latched_) return;
  if (mode_ == TorqueMode::kTorque && command.mode != TorqueMode::kTorque) {
    released_A_ = applied_A_;
    torque_share_ = 1;
  }
  mode_ = command.mode;
  watchdog_ = std::min(from_seconds(device_.watchdog_s), Duration(std::chrono::milliseconds(command.watchdog_ms)));
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double limit =
        std::min<double>(command.limit_permille[i], 1e3 * device_.peak_current_A[i] / device_.rated_current_A[i]);
    asked_A_[i] = std::clamp<double>(command.torque_permille[i], -limit, limit) * 1e-3 * device_.rated_current_A[i];
  }
}

void DeviceFirmware::latch(std::uint16_t fault) noexcept {
  fault_ |= fault;
  if (latched_) return;
  latched_ = true;
  if (mode_ == TorqueMode::kTorque) {
    released_A_ = applied_A_;
    torque_share_ = 1;
  }
  mode_ = TorqueMode::kDamp;
}

PerJoint<double> DeviceFirmware::drive() noexcept {
  if (mode_ == TorqueMode::kTorque) {
    torque_share_ = damp_share_ = 0;
    return applied_A_ = asked_A_;
  }
  torque_share_ = std::max(0.0, torque_share_ - kTick_s / kReleaseTime_s);
  damp_share_ = mode_ == TorqueMode::kDamp ? std::min(1.0, damp_share_ + kTick_s / kDampFadeIn_s) : 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double gear = device_.gear_ratio[i];
    const double inertia_kgm2 = device_.rotor_inertia_kgm2[i] + device_.link_inertia_kgm2[i] / (gear * gear);
    const double motor_radps = 2 * std::numbers::pi * tracked_rate_[i] / device_.counts_per_turn[i];
    const double damping_A = -inertia_kgm2 / kDampTime_s * motor_radps / device_.torque_constant_Nm_per_A[i];
    applied_A_[i] = torque_share_ * released_A_[i] + damp_share_ * damping_A;
  }
  return applied_A_;
}

void DeviceFirmware::write(HidReport report) noexcept {
  if (injected_ == FirmwareFault::kTruncated) std::fill(report.begin() + kTruncatedSize, report.end(), 0);
  cable_.write(report);
}

void DeviceFirmware::send_state(Time now, const DeviceSensors& sensors) noexcept {
  if (injected_ == FirmwareFault::kFrozen) {
    write(last_report_);
    return;
  }
  DeviceState state;
  state.sequence = ++sequence_;
  state.device_time_us = std::uint32_t(now.time_since_epoch().count() / 1000);
  state.counts = sensors.counts;
  if (injected_ == FirmwareFault::kWildCounts) state.counts.fill(std::numeric_limits<std::int32_t>::min());
  for (std::size_t i = 0; i < kJoints; ++i) {
    state.counts_per_s[i] = to_i32(tracked_rate_[i]);
    state.current_mA[i] = to_i16(sensors.current_A[i] * 1e3);
  }
  state.status = std::uint16_t((sensors.presence ? kDevicePresence : 0) | (sensors.enable ? kDeviceEnable : 0) |
                               (sensors.clutch ? kDeviceClutch : 0) | (sensors.stop ? kDeviceStop : 0) |
                               (latched_ ? kDeviceLatched : 0));
  if (mode_ == TorqueMode::kTorque && injected_ != FirmwareFault::kUnpowered) state.status |= kDeviceTorqueOn;
  state.fault = fault_;
  state.last_command_sequence = command_sequence_;
  state.bus_mV = 24000;
  state.temperature_dC = to_i16(10 * (25 + 60 * *std::ranges::max_element(sensors.heat)));
  last_report_ = encode(state);
  HidReport sent = last_report_;
  if (injected_ == FirmwareFault::kBadCrc) sent[20] ^= 0x55;
  write(sent);
}

}  // namespace knuckle::sim
