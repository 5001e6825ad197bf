// `knuckle doctor`: checks this computer, a machine bus or a haptic device. Reads only.
#pragma once

#include <string>
#include <vector>

#include "app/bringup/doctor_bus.h"
#include "app/bringup/doctor_finding.h"
#include "app/cli/command.h"
#include "app/cli/json.h"

namespace knuckle::bringup {

// The output of `knuckle doctor`, for people and for tools (docs/commissioning.md).

/// One line each: faults, notes, ok.
[[nodiscard]] std::vector<std::string> finding_lines(const Findings& findings);
/// The table of nodes, an empty line, the findings.
[[nodiscard]] std::vector<std::string> diagnosis_lines(const BusDiagnosis& diagnosis);

[[nodiscard]] cli::Json findings_json(const Findings& findings);
[[nodiscard]] cli::Json diagnosis_json(const BusDiagnosis& diagnosis);

/// Exit codes: 0 no fault; 1 a fault; 2 wrong usage, or the bus cannot be opened.
[[nodiscard]] cli::Command doctor_entry();

}  // namespace knuckle::bringup
