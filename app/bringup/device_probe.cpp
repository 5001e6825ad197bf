#include "app/bringup/device_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "app/cli/command.h"
#include "core/error.h"
#include "core/loop_table.h"
#include "core/realtime_thread.h"
#include "machine/load.h"

namespace knuckle::bringup {

namespace {

constexpr Duration kLook = 1ms;
constexpr Duration kAskAgain = 100ms;

void count(DeviceListening& heard, const DeviceState& state) {
  if (heard.reports == 0) {
    heard.lowest = heard.highest = state.counts;
  } else {
    const auto ahead = std::int16_t(state.sequence - heard.newest.sequence);
    const auto gap_us = std::int32_t(state.device_time_us - heard.newest.device_time_us);
    heard.missed += ahead > 1 ? std::uint64_t(ahead - 1) : 0;
    heard.longest_gap_ms = std::max(heard.longest_gap_ms, 1e-3 * gap_us);
    heard.spanned_s += 1e-6 * gap_us;
  }
  ++heard.reports;
  heard.newest = state;
  heard.status_seen |= state.status;
  for (std::size_t i = 0; i < kJoints; ++i) {
    heard.lowest[i] = std::min(heard.lowest[i], state.counts[i]);
    heard.highest[i] = std::max(heard.highest[i], state.counts[i]);
  }
}

/// One line where they are further apart than the floats of the wire.
template <typename A, typename B>
void compare(std::vector<std::string>& lines, std::size_t joint, const char* what, A device, B file) {
  if (std::abs(double(device) - double(file)) <= 1e-3 * std::abs(double(file))) return;
  std::ostringstream line;
  line << kDeviceJointNames[joint] << ": " << what << ' ' << device << ", file " << file;
  lines.push_back(line.str());
}

}  // namespace

DeviceProbe::DeviceProbe(HidPort& port, std::function<void(Duration)> wait) : port_(port), wait_(std::move(wait)) {}

std::optional<DeviceIdentity> DeviceProbe::identity(Duration patience) {
  HidReport report;
  Duration asked = kAskAgain;
  for (Duration waited{}; waited < patience; waited += kLook, asked += kLook) {
    wait_(kLook);
    if (!port_.connected()) continue;
    if (asked >= kAskAgain) {
      asked = {};
      port_.write(encode_describe_request());
    }
    while (port_.read(report)) {
      if (const auto identity = decode_identity(report)) return identity;
    }
  }
  return std::nullopt;
}

DeviceListening DeviceProbe::listen(Duration length) {
  DeviceListening heard;
  HidReport report;
  while (port_.connected() && port_.read(report)) continue;  // older than what was asked for
  for (Duration waited{}; waited < length; waited += kLook) {
    wait_(kLook);
    while (port_.connected() && port_.read(report)) {
      if (const auto state = decode_state(report)) {
        count(heard, *state);
      } else if (!decode_identity(report)) {
        ++heard.damaged;
      }
    }
  }
  return heard;
}

void add_device_choice(const cli::OptionList& command, HidChoice& choice) {
  command.add_option("--serial", choice.serial, "USB serial number of the device, where several are attached");
  command.add_option("--usb-port", choice.usb_port,
                     "USB port of the device, such as 1-2.3, where several have the same serial number");
}

void check_no_device_choice(const HidChoice& choice, const char* goes_with) {
  if (!choice.serial.empty()) cli::refuse_option("--serial", choice.serial, goes_with);
  if (!choice.usb_port.empty()) cli::refuse_option("--usb-port", choice.usb_port, goes_with);
}

std::unique_ptr<HidDevicePort> open_device_port(const std::string& option, const std::string& back_end,
                                                const HidDeviceOptions& options) {
  if (back_end == "hid") return std::make_unique<HidDevicePort>(open_hidapi, options);
  if (back_end == "usb") return std::make_unique<HidDevicePort>(open_libusb, options);
  throw InputError(option + " " + back_end + ": must be one of " + kDeviceBackEnds);
}

std::unique_ptr<HidDevicePort> open_leading_device(const std::string& back_end, const HidChoice& choice) {
  if (back_end != "hid" && back_end != "usb") return nullptr;
  return open_device_port("--device", back_end, {.choice = choice, .fifo_priority = fifo_priority::kDevicePort});
}

std::vector<HidCandidate> list_devices(const std::string& back_end) {
  return back_end == "usb" ? libusb_devices() : hidapi_devices();
}

std::vector<std::string> differences(const DeviceIdentity& identity, const DeviceDescription& file) {
  std::vector<std::string> lines;
  if (file.serial != 0 && identity.serial != file.serial) {
    lines.push_back("serial number " + std::to_string(identity.serial) + ", file " + std::to_string(file.serial));
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    compare(lines, i, "counts per turn", identity.counts_per_turn[i], file.counts_per_turn[i]);
    compare(lines, i, "gear ratio", identity.gear_ratio[i], file.gear_ratio[i]);
    compare(lines, i, "torque constant [mNm/A]", 1e3F * identity.torque_constant_Nm_per_A[i],
            1e3 * file.torque_constant_Nm_per_A[i]);
    compare(lines, i, "rated current [A]", 1e-3 * identity.rated_current_mA[i], file.rated_current_A[i]);
    if (file.serial == 0) compare(lines, i, "sign", int(identity.joint_sign[i]), file.joint_sign[i]);
  }
  return lines;
}

namespace {

using Level = Finding::Level;
constexpr Duration kAttachPatience = 2s, kDescribePatience = 1s, kListen = 2s;
constexpr double kReports_Hz = 1000, kRateTolerance = 0.02, kMostMissed = 0.01;
constexpr double kLongestGap_ms = 10;  // half of the driver's limit for stale reports
constexpr double kIdleCurrent = 0.05;  // of rated, while no torque is commanded
constexpr double kRangeMargin_rad = 0.15;
constexpr const char* kAbout = "haptic device";

std::string bits_text(unsigned bits, std::initializer_list<std::pair<unsigned, const char*>> names) {
  std::string text;
  for (const auto& [bit, name] : names) {
    if ((bits & bit) != 0) text += (text.empty() ? "" : ", ") + std::string(name);
  }
  return text.empty() ? "none" : text;
}

Finding judge_stream(const DeviceListening& heard) {
  const double rate_Hz = heard.spanned_s > 0 ? double(heard.reports - 1) / heard.spanned_s : 0;
  const double missed = double(heard.missed) / double(heard.reports + heard.missed);
  const std::string text = fmt::format("{:.0f} reports/s, {:.2f} % missed, {} damaged, longest gap {:.1f} ms", rate_Hz,
                                       100 * missed, heard.damaged, heard.longest_gap_ms);
  const bool well = std::abs(rate_Hz - kReports_Hz) <= kRateTolerance * kReports_Hz && missed <= kMostMissed &&
                    heard.damaged == 0 && heard.longest_gap_ms <= kLongestGap_ms;
  if (well) return {Level::kOk, "reports", text};
  return {Level::kFault, "reports",
          text +
              ", required: 1000 reports/s +-2 %, at most 1 % missed, none damaged, gaps of at most 10 ms: check cable, "
              "hub and other programs on this computer"};
}

Finding judge_faults(const DeviceListening& heard) {
  const bool latched = (heard.newest.status & kDeviceLatched) != 0;
  const std::string text = bits_text(heard.newest.fault, {{kDeviceFaultWatchdog, "watchdog"},
                                                          {kDeviceFaultCrc, "damaged command"},
                                                          {kDeviceFaultSequence, "repeated command"},
                                                          {kDeviceFaultOvertemperature, "motor too hot"},
                                                          {kDeviceFaultOvercurrent, "overcurrent"},
                                                          {kDeviceFaultEncoder, "encoder"}});
  constexpr unsigned kOfItsOwn = kDeviceFaultOvertemperature | kDeviceFaultOvercurrent | kDeviceFaultEncoder;
  if ((heard.newest.fault & kOfItsOwn) != 0) return {Level::kFault, "faults", text + ": see docs/haptic-device.md"};
  if (latched || heard.newest.fault != 0) {
    return {Level::kNote, "faults", text + ": latched in an earlier session; the next session clears it"};
  }
  return {Level::kOk, "faults", text};
}

Finding judge_buttons(const DeviceListening& heard) {
  const std::string text = bits_text(
      heard.status_seen,
      {{kDevicePresence, "presence"}, {kDeviceEnable, "enable"}, {kDeviceClutch, "clutch"}, {kDeviceStop, "stop"}});
  return {Level::kNote, "buttons", "active during the check: " + text + " (hold each of them while this runs)"};
}

Finding judge_supply(const DeviceListening& heard) {
  return {Level::kOk, "supply",
          fmt::format("{:.1f} V, warmest motor {:.1f} degC", 1e-3 * heard.newest.bus_mV,
                      0.1 * heard.newest.temperature_dC)};
}

/// With the signs and zeros that the driver uses: of a calibrated file, else as reported by the device.
Finding judge_joint(const DeviceListening& heard, const DeviceIdentity& identity, const DeviceDescription& file,
                    std::size_t joint) {
  const char* name = kDeviceJointNames[joint];
  const bool calibrated = file.serial != 0;
  const double sign = calibrated ? file.joint_sign[joint] : identity.joint_sign[joint];
  const double zero = calibrated ? file.zero_counts[joint] : identity.zero_counts[joint];
  const double per_count =
      2 * std::numbers::pi / (sign * double(identity.gear_ratio[joint]) * identity.counts_per_turn[joint]);
  const double angle_rad = per_count * (heard.newest.counts[joint] - zero);
  const double current_A = 1e-3 * heard.newest.current_mA[joint];
  const std::string text = fmt::format("{} counts = {:.1f} deg, {:.2f} A", heard.newest.counts[joint],
                                       angle_rad * 180 / std::numbers::pi, current_A);
  if (angle_rad < file.min_rad[joint] - kRangeMargin_rad || angle_rad > file.max_rad[joint] + kRangeMargin_rad) {
    return {
        Level::kFault, name,
        text + fmt::format(", outside its range {:.1f} to {:.1f} deg: run knuckle calibrate-device",
                           file.min_rad[joint] * 180 / std::numbers::pi, file.max_rad[joint] * 180 / std::numbers::pi)};
  }
  if (std::abs(current_A) > kIdleCurrent * 1e-3 * identity.rated_current_mA[joint] &&
      (heard.newest.status & kDeviceTorqueOn) == 0) {
    return {Level::kFault, name,
            text + ": motor current without commanded torque: do not hold the device, switch it off"};
  }
  return {Level::kOk, name, text};
}

Findings one_fault(std::string text) {
  return {{Level::kFault, kAbout, std::move(text)}};
}

}  // namespace

Findings examine_device(DeviceProbe& probe, const DeviceDescription& file) {
  const auto identity = probe.identity(kDescribePatience);
  if (!identity) {
    return one_fault("does not describe itself: its firmware does not answer report 4, or requests do not reach it");
  }
  Findings found{{Level::kOk, kAbout, "describes itself, serial number " + std::to_string(identity->serial)}};
  for (const std::string& difference : differences(*identity, file)) {
    found.push_back(
        {Level::kFault, kAbout,
         difference + " (" + file.source + "): use this device's own file, or run knuckle calibrate-device"});
  }
  if (file.serial == 0) {
    found.push_back(
        {Level::kNote, kAbout, file.source + " is uncalibrated: signs and zeros are those reported by the device"});
  }
  const DeviceListening heard = probe.listen(kListen);
  if (heard.reports == 0) {
    found.push_back({Level::kFault, "reports", "no undamaged state report (report 1) received"});
    return found;
  }
  found.insert(found.end(), {judge_stream(heard), judge_faults(heard), judge_supply(heard), judge_buttons(heard)});
  for (std::size_t i = 0; i < kJoints; ++i) found.push_back(judge_joint(heard, *identity, file, i));
  return found;
}

Findings doctor_device(const DeviceDoctorOptions& options) {
  const DeviceDescription file = load_device(find_config("device", options.device));
  const auto port = open_device_port("--device", options.back_end, {.choice = options.choice});
  const RealtimeClock clock;
  const auto wait = [&clock](Duration time) { clock.sleep_until(clock.now() + time); };
  for (Duration waited{}; !port->status().attached && waited < kAttachPatience; waited += 10ms) wait(10ms);
  if (const HidDeviceStatus status = port->status(); !status.attached) {
    const bool only_usb = options.back_end == "hid" && list_devices("hid").empty() && !list_devices("usb").empty();
    return one_fault(status.problem +
                     (only_usb ? "; USB lists one: try --device usb, or load the kernel module usbhid" : ""));
  }
  DeviceProbe probe(*port, wait);
  return examine_device(probe, file);
}

}  // namespace knuckle::bringup
