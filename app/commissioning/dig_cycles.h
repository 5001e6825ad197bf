// Dig cycles of a large excavator, recorded on a real machine (config/maps/excavator_dig_cycles.toml): what is wrong
// with the files, which labels of channels look wrong and why, and the arm's geometry from angles and tip.
#pragma once

#include <string>
#include <vector>

#include "app/commissioning/real_rows.h"

namespace knuckle::app {

/// Everything a table of results needs: geometry fitted on train_dir and judged on test_dir, findings over both.
/// @param train_dir, test_dir folders with one CSV a cycle.
/// @throws InputError where a folder has no usable cycle.
[[nodiscard]] std::vector<RealRow> dig_cycle_rows(const std::string& train_dir, const std::string& test_dir);

}  // namespace knuckle::app
