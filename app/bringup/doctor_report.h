// What `knuckle doctor` says, for people and for tools (docs/commissioning.md lists the keys).
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>

#include "app/bringup/doctor_bus.h"
#include "app/bringup/doctor_finding.h"

namespace knuckle::bringup {

/// One line each; what is well comes last.
void print_findings(const Findings& findings, std::ostream& out);
/// The table of nodes and the findings.
void print_diagnosis(const BusDiagnosis& diagnosis, std::ostream& out);

[[nodiscard]] nlohmann::ordered_json findings_json(const Findings& findings);
[[nodiscard]] nlohmann::ordered_json diagnosis_json(const BusDiagnosis& diagnosis);

}  // namespace knuckle::bringup
