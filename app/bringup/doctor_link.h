// Whether the machine's side can be reached and lets this computer in; each failure in one line.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "app/bringup/doctor_finding.h"

namespace knuckle::bringup {

struct LinkDoctorOptions {
  std::string address;  ///< Of the machine's side; its name may have several addresses.
  std::string keys;     ///< Folder; empty: the usual one.
  std::chrono::milliseconds patience{4000};
};
/// Takes control from nobody. @param keep_on asked now and then; false ends it.
[[nodiscard]] Findings doctor_link(const LinkDoctorOptions& options, const std::function<bool()>& keep_on);

}  // namespace knuckle::bringup
