#include "app/bringup/device_probe.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "app/cli/command.h"
#include "core/error.h"
#include "core/loop_table.h"
#include "machine/device_description.h"
#include "transport/hidapi_port.h"
#include "transport/libusb_port.h"

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
  if (back_end == "hid") return std::make_unique<HidapiPort>(options);
  if (back_end == "usb") return std::make_unique<LibusbPort>(options);
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

}  // namespace knuckle::bringup
