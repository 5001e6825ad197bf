#include "app/programs/device_faults.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "app/cli/command.h"

namespace knuckle::programs {
namespace {

[[noreturn]] void refuse(const std::string& text) {
  std::string kinds;
  for (const char* name : kDeviceFaultNames) kinds += (kinds.empty() ? "" : ", ") + std::string(name);
  cli::refuse_option("--fault", text, "must be KIND@S[+D], such as bad_crc@5+0.1, with a KIND of " + kinds);
}

double seconds(const std::string& fault, std::string_view text) {
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = end.ec == std::errc() && end.ptr == text.data() + text.size();
  if (!number || !(value >= 0 && value < 1e6)) refuse(fault);
  return value;
}

sim::FirmwareFault of_firmware(DeviceFaultKind kind) noexcept {
  switch (kind) {
    case DeviceFaultKind::kSilent:
      return sim::FirmwareFault::kSilent;
    case DeviceFaultKind::kBadCrc:
      return sim::FirmwareFault::kBadCrc;
    case DeviceFaultKind::kFrozen:
      return sim::FirmwareFault::kFrozen;
    case DeviceFaultKind::kWildCounts:
      return sim::FirmwareFault::kWildCounts;
    case DeviceFaultKind::kHung:
      return sim::FirmwareFault::kHung;
    case DeviceFaultKind::kTruncated:
      return sim::FirmwareFault::kNone;
  }
  return sim::FirmwareFault::kNone;
}

}  // namespace

PlannedDeviceFault parse_device_fault(const std::string& text) {
  const auto at = text.find('@');
  if (at == std::string::npos) refuse(text);
  const auto* const kind = std::find(kDeviceFaultNames.begin(), kDeviceFaultNames.end(), text.substr(0, at));
  if (kind == kDeviceFaultNames.end()) refuse(text);
  PlannedDeviceFault fault;
  fault.kind = static_cast<DeviceFaultKind>(kind - kDeviceFaultNames.begin());
  fault.text = text;
  const std::string_view times = std::string_view(text).substr(at + 1);
  const auto plus = times.find('+');
  fault.at_s = seconds(text, times.substr(0, plus));
  if (plus != std::string_view::npos) fault.duration_s = seconds(text, times.substr(plus + 1));
  return fault;
}

DeviceFaults::DeviceFaults(std::vector<PlannedDeviceFault> plan) : plan_(std::move(plan)), broken_(plan_.size()) {}

int DeviceFaults::step(Time now, sim::DeviceFirmware& firmware, TruncatingPort& port) noexcept {
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const double since_s = to_seconds(now) - plan_[i].at_s;
    const bool broken = since_s >= 0 && since_s < plan_[i].duration_s;
    if (broken == (broken_[i] != 0)) continue;
    broken_[i] = broken ? 1 : 0;
    firmware.inject(broken ? of_firmware(plan_[i].kind) : sim::FirmwareFault::kNone);
    port.truncate(broken && plan_[i].kind == DeviceFaultKind::kTruncated);
    return static_cast<int>(i);
  }
  return -1;
}

}  // namespace knuckle::programs
