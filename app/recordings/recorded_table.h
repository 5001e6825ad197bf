// The machine's signals and motion of a recording (.mcap) as the table that a CSV is read into.
#pragma once

#include <string>
#include <vector>

#include "app/recordings/csv_reader.h"

namespace knuckle::recordings {

/// By the name: it ends in ".mcap".
[[nodiscard]] bool is_recording(const std::string& path);

/// Channels: the sensors' (recording_reader.h); boom_rad, arm_rad, bucket_rad; boom_valve, ... where any command is
/// known. Rows are steps of the machine's side, counted from 1. Values of steps in which not every sensor had been
/// heard are NaN. Notes tell what of the file cannot be read.
/// @param parts of one recording, in their order. @param map_path must be empty.
/// @throws InputError also where the machine's side is not in it, or of another version.
[[nodiscard]] MappedTable read_recorded_table(const std::vector<std::string>& parts, const std::string& map_path);

}  // namespace knuckle::recordings
