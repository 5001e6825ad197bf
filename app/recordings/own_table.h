// Tables of Knuckle's own: every column by its name (docs/identification.md).
#pragma once

#include <string>
#include <vector>

#include "app/recordings/csv_reader.h"

namespace knuckle::recordings {

inline constexpr const char* kOwnTimeColumn = "time_s";
/// Of a recording: how long its usual step may be.
inline constexpr double kShortestStep_s = 2e-4, kLongestStep_s = 0.05;

/// What every one of them has.
[[nodiscard]] std::vector<std::string> own_columns();
[[nodiscard]] bool has_own_columns(const CsvFile& file);

/// @param file read with own_columns() wanted. @throws InputError naming all columns that are missing, and as
/// read_mapped_csv().
[[nodiscard]] MappedTable read_own_table(CsvFile file);

/// The sensors' values of rows that say that they were not measured are none: zeros stand there.
void forget_unmeasured(MappedTable& table);

}  // namespace knuckle::recordings
