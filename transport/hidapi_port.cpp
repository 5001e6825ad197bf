#include <hidapi/hidapi.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "transport/hid_device_port.h"
#include "transport/hid_reports.h"

namespace knuckle {
namespace {

/// Serial numbers are ASCII on USB; anything else would not match what the user types.
std::string narrow(const wchar_t* text) {
  std::string narrowed;
  for (; text != nullptr && *text != 0; ++text) narrowed += *text < 0x80 ? static_cast<char>(*text) : '?';
  return narrowed;
}

using HidapiHandle = std::unique_ptr<hid_device, decltype(&hid_close)>;

/// Of a device file such as /dev/hidraw0.
std::string usb_port_of_file(const std::string& path) {
  std::error_code error;
  const auto name = std::filesystem::path(path).filename();
  return usb_port_of(
      std::filesystem::canonical(std::filesystem::path("/sys/class/hidraw") / name / "device", error).string());
}

/// Two handles on one device: hidapi keeps its last error in the handle, so that each serves one thread only.
class HidapiConnection final : public HidConnection {
 public:
  HidapiConnection(HidapiHandle in, HidapiHandle out) : in_(std::move(in)), out_(std::move(out)) {}

  Result read(HidReport& report, Duration timeout) override {
    report = {};
    const auto wait_ms = std::chrono::duration_cast<std::chrono::milliseconds>(timeout).count();
    const int size = hid_read_timeout(in_.get(), report.data(), report.size(), static_cast<int>(wait_ms));
    if (size < 0) return Result::kGone;
    return size == 0 ? Result::kNothing : Result::kDone;
  }

  Result write(const HidReport& report) override {
    // A refused write does not say whether the device has gone; reading does.
    const int size = hid_write(out_.get(), report.data(), report.size());
    return size == static_cast<int>(report.size()) ? Result::kDone : Result::kNothing;
  }

 private:
  HidapiHandle in_, out_;
};

}  // namespace

HidOpening open_hidapi(const HidChoice& wanted) {
  HidOpening opening;
  const std::vector<HidCandidate> found = hidapi_devices();
  const HidCandidate* chosen = choose_device(found, wanted, opening.problem);
  if (chosen == nullptr) return opening;
  HidapiHandle in(hid_open_path(chosen->path.c_str()), hid_close);
  HidapiHandle out(in ? hid_open_path(chosen->path.c_str()) : nullptr, hid_close);
  if (!out) {
    opening.problem = chosen->path + " cannot be opened (" + narrow(hid_error(nullptr)) +
                      "): install config/udev/70-knuckle.rules and attach the device again";
    return opening;
  }
  opening.serial = chosen->serial;
  opening.connection = std::make_shared<HidapiConnection>(std::move(in), std::move(out));
  return opening;
}

std::vector<HidCandidate> hidapi_devices() {
  std::vector<HidCandidate> found;
  hid_device_info* all = hid_enumerate(kHidVendor, kHidProduct);
  for (const hid_device_info* info = all; info != nullptr; info = info->next) {
    const HidCandidate candidate{info->path, narrow(info->serial_number), usb_port_of_file(info->path)};
    // One device may show several collections; only the vendor page's is ours.
    const bool known = std::any_of(found.begin(), found.end(),
                                   [&candidate](const HidCandidate& other) { return other.path == candidate.path; });
    if (info->usage_page == kHidUsagePage && !known) found.push_back(candidate);
  }
  hid_free_enumeration(all);
  return found;
}

}  // namespace knuckle
