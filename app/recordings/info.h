// What is in a file of measurements, on one screen: a recording (.mcap) or a table (CSV).
#pragma once

#include <string>
#include <vector>

#include "app/cli/command.h"

namespace knuckle::recordings {

/// "1.2 MB", "3.4 kB".
[[nodiscard]] std::string size_of_file(const std::string& path);

struct FileInfo {
  std::vector<std::string> lines;
  bool whole = true;  ///< Not damaged, not cut off, and readable as what it is.
};

/// Of Knuckle's recordings, of any version, and those of others. @throws InputError where it is no MCAP file.
[[nodiscard]] FileInfo recording_info(const std::string& path);

/// @param map_path empty: as Knuckle's own where its columns are there; else columns and numbers as they stand.
/// @throws InputError where it cannot be read at all, or the mapping cannot.
[[nodiscard]] FileInfo table_info(const std::string& path, const std::string& map_path);

[[nodiscard]] cli::Command info_entry();

}  // namespace knuckle::recordings
