// `knuckle-studies real-recordings`: errors of Knuckle's methods on recordings of real machines, fitted on one folder
// and evaluated on another.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/studies/real_rows.h"

namespace knuckle::studies {

inline constexpr const char* kRealRecordingsSchema = "knuckle-real-recordings/1";

/// Rows of both datasets, excavator_dig_cycles and wheel_loader, from folders of these names in train_dir and test_dir.
/// A dataset that either of the two has not is left out, with one line on `said`.
/// @throws InputError where a folder does not exist, neither dataset is there, or a dataset cannot be used.
[[nodiscard]] std::vector<RealRow> real_rows(const std::string& train_dir, const std::string& test_dir,
                                             std::ostream& said);

/// {schema, version, rows[]: dataset, quantity, value, unit, baselines{name: value}}; null for what is no number.
void write_real_rows(const std::vector<RealRow>& rows, std::ostream& out);

/// The command: --train DIR --test DIR [--json FILE]. Prints a table.
[[nodiscard]] cli::Command real_recordings_entry();

}  // namespace knuckle::studies
