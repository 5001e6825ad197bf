// Reads a foreign CSV through a mapping file: for each Knuckle channel its column, unit, sign and offset, and how time
// is given. What is wrong with the data is found and named with row and column, never silently used.
#pragma once

#include <string>
#include <vector>

namespace knuckle::app {

/// One thing found in the data. Rows count from 1 with the header as row 1, as a spreadsheet shows them.
struct Finding {
  enum class Kind : unsigned char { kRepeatedRow, kRepeatedTime, kBackwardTime, kMissing, kNotANumber, kDropOut, kGap };
  Kind kind;
  std::size_t row;
  std::string column;
};
[[nodiscard]] const char* name(Finding::Kind kind) noexcept;

struct MappedChannel {
  std::string name;            ///< Knuckle's, with its unit: "boom_rad"
  std::vector<double> values;  ///< SI; NaN where the cell is not usable.
};

struct MappedTable {
  std::string source;
  std::vector<double> time_s;  ///< Strictly increasing, first row 0.
  std::vector<std::size_t> rows;
  std::vector<MappedChannel> channels;
  std::vector<Finding> findings;
  std::size_t rows_read = 0;
  /// @throws InputError where the mapping has no such channel.
  [[nodiscard]] const MappedChannel& channel(const std::string& channel_name) const;
  /// One line: "64 rows, 58 used; 5 repeated rows (first: row 12), 1 gap (row 40)".
  [[nodiscard]] std::string summary() const;
};

/// @throws InputError for an unreadable file, a wrong mapping, a column that is not there, or fewer than 4 usable rows.
[[nodiscard]] MappedTable read_mapped_csv(const std::string& csv_path, const std::string& map_path);

}  // namespace knuckle::app
