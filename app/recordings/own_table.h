// Tables of Knuckle's own: every column by its name (docs/identification.md).
#pragma once

#include <string>
#include <vector>

#include "app/recordings/csv_reader.h"
#include "machine/arm_description.h"

namespace knuckle::recordings {

inline constexpr const char* kOwnTimeColumn = "time_s";
/// Of a recording: how long its usual step may be.
inline constexpr double kShortestStep_s = 2e-4, kLongestStep_s = 0.05;

/// What every one of them has.
[[nodiscard]] std::vector<std::string> own_columns();
[[nodiscard]] bool has_own_columns(const CsvFile& file);

/// @param file read with own_columns() wanted. @throws InputError naming all columns that are missing, and as
/// read_mapped_csv().
[[nodiscard]] MappedTable read_own_table(CsvFile file, int without_pressures = SensorDescription::kNone);

/// The sensors' values of rows that say that they were not measured are none: zeros stand there.
void forget_unmeasured(MappedTable& table);

// The machine's signals and motion of a recording (.mcap) as the table that a CSV is read into.

/// By the name: it ends in ".mcap".
[[nodiscard]] bool is_recording(const std::string& path);

/// Channels: the sensors' (recording_reader.h); boom_rad, arm_rad, bucket_rad; boom_valve, ... where any command is
/// known. Rows are steps of the machine's side, counted from 1. Values of steps in which not every sensor had been
/// heard are NaN. Notes tell what of the file cannot be read.
/// @param parts of one recording, in their order. @param map_path must be empty.
/// @throws InputError also where the machine's side is not in it, or of another version.
[[nodiscard]] MappedTable table_of_recording(const std::vector<std::string>& parts, const std::string& map_path);

}  // namespace knuckle::recordings
