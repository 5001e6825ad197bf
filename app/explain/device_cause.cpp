#include "app/explain/device_cause.h"

#include <fmt/format.h>

#include "app/explain/text.h"

namespace knuckle::explain {
namespace {

constexpr int kCutShort = 8;  // zeros at the end that no whole report has: the check sum is there

bool of_device(ReasonCode code) {
  switch (code) {
    case ReasonCode::kDeviceLost:
    case ReasonCode::kDeviceStale:
    case ReasonCode::kDeviceReport:
    case ReasonCode::kDeviceFault:
    case ReasonCode::kDeviceIdentity:
    case ReasonCode::kStartingUp:  // a device whose self test runs again
      return true;
    default:
      return false;
  }
}

std::string reports_text(const Evidence& evidence) {
  if (!evidence.reports.last) return "no sound report is in the recording";
  return fmt::format("newest sound report at {} (usual every {:.1f} ms){}", at_text(*evidence.reports.last),
                     1e3 * to_seconds(evidence.reports.usual),
                     evidence.reports.next ? ", the next at " + at_text(*evidence.reports.next) : ", none after it");
}

Cause damaged(const Evidence& evidence, Time since) {
  const std::string count =
      fmt::format("{} reports in a row were damaged; {}", evidence.damaged_reports, reports_text(evidence));
  if (evidence.zeros >= kCutShort) {
    return {"device_reports_cut_short",
            fmt::format("the haptic device's reports end early: only {} of their 64 bytes have content; check its "
                        "firmware and USB",
                        64 - evidence.zeros),
            {count, "reports kept coming: cable and firmware are alive"},
            {},
            since};
  }
  return {"device_reports_damaged",
          "the haptic device's reports arrive whole, but their check sum (CRC) is wrong: damaged by cable, USB or "
          "firmware",
          {count, "reports kept coming, of full length: neither unplugged nor silent"},
          {},
          since};
}

}  // namespace

std::optional<Cause> device_cause(const Stop& stop, const Window& window, const Evidence& evidence) {
  if (!of_device(stop.reason.code)) return std::nullopt;
  const Time since = evidence.reports.last.value_or(stop.at);
  if (window.operator_steps.empty())
    return Cause{"device",
                 "the haptic device: the operator's side said \"" + text(stop.reason) + "\"",
                 {"the operator's messages kept coming: link and program there are sound"},
                 {"the device's own wire is not in this recording: see that of the operator's side"},
                 stop.at};
  if (evidence.unplugged)
    return Cause{"device_unplugged",
                 "the haptic device was disconnected at " + at_text(*evidence.unplugged) +
                     ": its cable was pulled or it lost power",
                 {"USB reported it as gone; " + reports_text(evidence)},
                 {"a device that only hangs would stay connected"},
                 *evidence.unplugged};
  if (evidence.damaged_reports > 0) return damaged(evidence, since);
  if (evidence.reports.silent())
    return Cause{
        "device_silent",
        "the haptic device stopped sending at " + at_text(since) + " although it stayed connected: its firmware hangs",
        {reports_text(evidence), "USB never reported it as gone, and no damaged report came"},
        {},
        since};
  if (stop.reason.code == ReasonCode::kDeviceReport)
    return Cause{"device_values_impossible",
                 "the haptic device sends values that cannot be, in reports that are sound: its encoders or its "
                 "firmware are faulty",
                 {"the check sum of its reports is right: not the cable; " + reports_text(evidence)},
                 {},
                 stop.at};
  return Cause{"device_says_so",
               "the haptic device cannot be used, by its own account: " + text(stop.reason),
               {"its reports kept coming with a right check sum; " + reports_text(evidence)},
               {"a jump of the operator's clock makes its reports look old"},
               stop.at};
}

}  // namespace knuckle::explain
