// Dig cycles of a large excavator, recorded on a real machine (config/maps/excavator_dig_survey.toml): what is wrong
// with the files, which labels of channels look wrong and why, and the arm's geometry from angles and tip.
#pragma once

#include <string>
#include <vector>

#include "app/recordings/csv_reader.h"
#include "app/studies/real_rows.h"
#include "app/studies/tip_geometry.h"

namespace knuckle::studies {

/// All CSV files of a folder, by name. @throws InputError where there is none or one cannot be used.
[[nodiscard]] std::vector<recordings::MappedTable> read_dig_cycles(const std::string& dir);

/// Rows with all angles and a tip; rates from the neighbouring rows.
[[nodiscard]] std::vector<TipSample> tip_samples(const std::vector<recordings::MappedTable>& cycles);

/// Geometry fitted on train_dir and judged on test_dir; labels and defects over both.
/// @param train_dir, test_dir folders with one CSV a cycle.
/// @throws InputError where a folder has no usable cycle.
[[nodiscard]] std::vector<RealRow> dig_cycle_rows(const std::string& train_dir, const std::string& test_dir);

}  // namespace knuckle::studies
