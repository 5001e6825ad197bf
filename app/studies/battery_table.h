// From many machines' metrics to the rows of one table: quantity, method, value, unit, target, met.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/battery/rows.h"

namespace knuckle::studies {

using battery::Row;

struct BatteryRow {
  std::string quantity, method;
  double value = 0;  ///< NaN where no machine had one.
  std::string unit;
  std::string target;       ///< "<= 30", ">= 0.97", "0.9 to 0.99"; empty: stated only.
  std::optional<bool> met;  ///< Null without a target. Targets are for the method "full" alone.
};

/// Rows in a fixed order; the methods in the order of the first machine that has them.
/// @param machines as judge_machine() gives them.
[[nodiscard]] std::vector<BatteryRow> battery_rows(const std::vector<Row>& machines, double full_scale_kg);

}  // namespace knuckle::studies
