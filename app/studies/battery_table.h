// From many machines' scores to the rows of one table: quantity, method, value, unit, target, met.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/studies/battery_machine.h"

namespace knuckle::studies {

struct BatteryRow {
  std::string quantity, method;
  double value = 0;  ///< NaN where no machine had one.
  std::string unit;
  std::string target;       ///< "<= 30", ">= 0.97", "0.9 to 0.99"; empty: stated only.
  std::optional<bool> met;  ///< Null without a target. Targets are for the method "full" alone.
};

/// Rows in a fixed order; the methods of the machines' outcomes in the order of the first machine.
[[nodiscard]] std::vector<BatteryRow> battery_rows(const std::vector<MachineOutcome>& machines, double full_scale_kg);

}  // namespace knuckle::studies
