// Driver of the haptic device over its HID reports.
#include "master/device_driver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace knuckle::master {
namespace {

constexpr Duration kDescribePeriod = 100ms;
constexpr Duration kReportAgeLimit = 20ms;  // the firmware's own watchdog takes torque away after as long
constexpr Duration kRestartAge = 1s;        // then it is treated as newly attached: its sequence may have started again
constexpr Duration kTorquePatience = 50ms;  // from the first command in torque mode on
constexpr Duration kSettleTime = 100ms;    // good reports before the device is ok (again): no fault is too short to see
constexpr int kBadReportLimit = 3;         // damaged or implausible, in a row
constexpr int kMostReports = 64;           // a step: a flood is cut off, not followed
constexpr double kRangeMargin_rad = 0.15;  // end stops give way a little
constexpr double kRateLimit_radps = 60;
// Device's clock against ours: two crystals, and a time service that slews ours (ntpd, systemd-timesyncd: 500e-6).
constexpr double kClockDrift = 700e-6;

bool agrees(double a, double b) noexcept {
  return std::abs(a - b) <= 1e-3 * std::abs(b);
}

}  // namespace

DeviceDriver::DeviceDriver(const DeviceDescription& device, HidPort& port) noexcept
    : device_(device), port_(port), calibrated_(device.serial != 0), serial_(device.serial) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double sign_gear = device.joint_sign[i] * device.gear_ratio[i];
    rad_per_count_[row] = 2 * std::numbers::pi / (sign_gear * device.counts_per_turn[i]);
    permille_per_Nm_[row] = 1e3 / (sign_gear * device.torque_constant_Nm_per_A[i] * device.rated_current_A[i]);
  }
}

const DeviceReading& DeviceDriver::step(Time now) noexcept {
  stepped_at_ = now;
  if (port_.connected()) {
    if (!attached_ || (reported_ && now - reading_.measured_at > kRestartAge)) attach(now);
    if (!identity_ && now - described_at_ >= kDescribePeriod) {
      described_at_ = now;
      port_.write(encode_describe_request());
    }
    drain(now);
  } else if (attached_) {
    detach();
  }
  const Reason reason = judge(now);
  if (reason) {
    bad_since_ = now;
    reading_.reason = reason;
  } else if (now - bad_since_ >= kSettleTime) {
    reading_.reason = {};
  }
  reading_.ok = !reading_.reason;
  const auto pressed = [this](DeviceStatus bit) { return reading_.ok && (buttons_ & bit) != 0; };
  reading_.presence = pressed(kDevicePresence);
  // A finger that stayed on the button while the device was gone has not pressed it.
  enable_seen_released_ = reading_.ok && (enable_seen_released_ || (buttons_ & kDeviceEnable) == 0);
  reading_.enable = enable_seen_released_ && pressed(kDeviceEnable);
  reading_.clutch = pressed(kDeviceClutch);
  reading_.stop = pressed(kDeviceStop);
  return reading_;
}

void DeviceDriver::attach(Time now) noexcept {
  if (!attached_) attached_at_ = now;  // one that fell silent is not starting up
  attached_ = true;
  asked_since_ = kNever;
  ++reading_.attachments;
  identity_.reset();
  wrong_device_ = reported_ = false;
  described_at_ = now - kDescribePeriod;
  bad_in_a_row_ = 0;
  HidReport stale;
  // Whatever was on the way when the cable was pulled.
  for (int i = 0; i < kMostReports && port_.read(stale); ++i) ++counters_.discarded_old;
}

void DeviceDriver::detach() noexcept {
  attached_ = false;
  identity_.reset();
  buttons_ = 0;
}

void DeviceDriver::drain(Time now) noexcept {
  HidReport report;
  for (int i = 0; i < kMostReports && port_.read(report); ++i) {
    if (const auto state = decode_state(report)) {
      ++counters_.reports;
      const int ahead = static_cast<std::int16_t>(state->sequence - newest_.sequence);
      if (reported_ && ahead <= 0) {
        ++counters_.discarded_old;
        continue;
      }
      if (reported_) counters_.missed += static_cast<std::uint64_t>(ahead - 1);
      if (identity_) take(*state, age_of(*state, now), now);
    } else if (const auto identity = decode_identity(report)) {
      check_identity(*identity);
    } else {
      ++counters_.damaged;
      ++bad_in_a_row_;
    }
  }
}

void DeviceDriver::check_identity(const DeviceIdentity& identity) noexcept {
  bool same = serial_ == 0 || identity.serial == serial_;
  for (std::size_t i = 0; i < kJoints; ++i) {
    same = same && identity.counts_per_turn[i] == device_.counts_per_turn[i] &&
           (calibrated_ || identity.joint_sign[i] == device_.joint_sign[i]) &&
           agrees(static_cast<double>(identity.gear_ratio[i]), device_.gear_ratio[i]) &&
           agrees(static_cast<double>(identity.torque_constant_Nm_per_A[i]), device_.torque_constant_Nm_per_A[i]) &&
           agrees(identity.rated_current_mA[i] * 1e-3, device_.rated_current_A[i]);
  }
  wrong_device_ = !same;
  if (!same) return;
  serial_ = identity.serial;
  identity_ = identity;
}

Duration DeviceDriver::age_of(const DeviceState& state, Time now) noexcept {
  const Duration passed = std::chrono::microseconds(
      reported_ ? static_cast<std::int64_t>(static_cast<std::int32_t>(state.device_time_us - last_device_us_))
                : static_cast<std::int64_t>(state.device_time_us));
  device_time_ = reported_ ? device_time_ + passed : passed;
  last_device_us_ = state.device_time_us;
  const Duration travel = now.time_since_epoch() - device_time_;
  const Duration drift = from_seconds(kClockDrift * std::max(0.0, to_seconds(passed)));
  quickest_ = reported_ ? std::min(travel, quickest_ + drift) : travel;
  return travel - quickest_;
}

void DeviceDriver::take(const DeviceState& state, Duration age, Time now) noexcept {
  JointVector joint_rad, rate_radps;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double zero_counts = calibrated_ ? device_.zero_counts[i] : identity_->zero_counts[i];
    joint_rad[row] = rad_per_count_[row] * (state.counts[i] - zero_counts);
    rate_radps[row] = rad_per_count_[row] * state.counts_per_s[i];
  }
  newest_.sequence = state.sequence;
  if (!plausible(joint_rad, rate_radps, now - age)) {
    ++counters_.implausible;
    ++bad_in_a_row_;
    return;
  }
  newest_ = state;
  buttons_ = state.status;
  bad_in_a_row_ = 0;
  reported_ = true;
  reading_.joint_rad = joint_rad;
  reading_.rate_radps = rate_radps;
  reading_.measured_at = now - age;
}

bool DeviceDriver::plausible(const JointVector& joint_rad, const JointVector& rate_radps,
                             Time measured_at) const noexcept {
  const double since_last_s = to_seconds(measured_at - reading_.measured_at);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const bool in_range = joint_rad[row] >= device_.min_rad[i] - kRangeMargin_rad &&
                          joint_rad[row] <= device_.max_rad[i] + kRangeMargin_rad;
    const bool jumped = reported_ && std::abs(joint_rad[row] - reading_.joint_rad[row]) >
                                         kRateLimit_radps * std::max(since_last_s, 2e-3);
    if (!in_range || jumped || std::abs(rate_radps[row]) > kRateLimit_radps) return false;
  }
  return true;
}

Reason DeviceDriver::judge(Time now) const noexcept {
  if (!attached_) return {ReasonCode::kDeviceLost, 0, 0, 0};
  if (wrong_device_) return {ReasonCode::kDeviceIdentity, 0, 0, 0};
  if (bad_in_a_row_ >= kBadReportLimit) {
    return {ReasonCode::kDeviceReport, 0, static_cast<float>(bad_in_a_row_), static_cast<float>(kBadReportLimit)};
  }
  if (!reported_) {
    const Duration mute = now - attached_at_;
    if (mute <= kRestartAge) return {ReasonCode::kStartingUp, 0, 0, 0};
    return {ReasonCode::kDeviceStale, 0, to_ms(mute), to_ms(kReportAgeLimit)};
  }
  const Duration age = now - reading_.measured_at;
  if (age > kReportAgeLimit) {
    return {ReasonCode::kDeviceStale, 0, to_ms(age), to_ms(kReportAgeLimit)};
  }
  if (newest_.fault != 0 || (newest_.status & kDeviceLatched) != 0) {
    return {ReasonCode::kDeviceFault, 0, static_cast<float>(newest_.fault), 0};
  }
  const bool asked = asked_since_ != kNever && now - asked_since_ > kTorquePatience;
  if (asked && (newest_.status & kDeviceTorqueOn) == 0) return {ReasonCode::kDeviceUnpowered, 0, 0, 0};
  return {};
}

void DeviceDriver::command(const JointVector& torque_Nm) noexcept {
  if (!attached_) return;
  DeviceCommand command;
  command.sequence = ++command_sequence_;
  const bool unpowered = reading_.reason.code == ReasonCode::kDeviceUnpowered;
  const bool on = (reading_.ok || unpowered) && !let_go_;
  if (!on)
    asked_since_ = kNever;
  else if (asked_since_ == kNever)
    asked_since_ = stepped_at_;
  command.mode = on ? TorqueMode::kTorque : TorqueMode::kOff;
  command.watchdog_ms = static_cast<std::uint16_t>(std::lround(device_.watchdog_s * 1e3));
  command.echoed_sequence = newest_.sequence;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double peak = std::min(32767.0, 1e3 * device_.peak_current_A[i] / device_.rated_current_A[i]);
    command.limit_permille[i] = static_cast<std::uint16_t>(peak);
    if (!on || unpowered) continue;
    const double permille = permille_per_Nm_[static_cast<Eigen::Index>(i)] * torque_Nm[static_cast<Eigen::Index>(i)];
    command.torque_permille[i] =
        static_cast<std::int16_t>(std::isfinite(permille) ? std::lround(std::clamp(permille, -peak, peak)) : 0);
  }
  port_.write(encode(command));
}

}  // namespace knuckle::master
