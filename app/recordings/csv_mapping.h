// A mapping file: which column of a foreign CSV holds which Knuckle channel, in what unit, sign and offset, and how its
// time is written.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/recordings/csv_cells.h"

namespace knuckle::recordings {

inline constexpr double kAnyCell = 1e12;  ///< Bound of a cell where a mapping gives none.

inline constexpr double kOwnGap_s = 0.05;  ///< Longer steps in time are gaps in files of Knuckle's own.

/// Knuckle's value [SI] = cell * factor + offset.
struct ChannelMap {
  std::string name, column;
  double factor = 1, offset = 0;
  double min = -kAnyCell, max = kAnyCell;  ///< Bounds of a believable cell, in the file's unit.
  bool zero_is_drop_out = false;
};

/// Time from a column (a number, or a date and time inside text), or from equally spaced rows.
struct TimeMap {
  std::string column, pattern;
  double factor = 1;    ///< Seconds a unit of the column; 0: it is not said, and found by the size of Unix times.
  double period_s = 0;  ///< Above 0: rows are equally spaced and there is no column.
  /// Seconds, of a cell; NaN where it holds no time within 1e12 s. With a pattern counted from 1970-01-01.
  [[nodiscard]] double seconds_in(const std::string& cell, char decimal_mark = '.') const;
};

struct TimeUnit {
  const char* name;
  double factor;  ///< Seconds.
};
inline constexpr std::array<TimeUnit, 4> kTimeUnits{{{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};
/// Of the numbers in a column of times; NaN where there are none.
struct TimesSeen {
  double middle, step;  ///< Medians.
};
[[nodiscard]] TimesSeen times_seen(const CsvFile& file, std::size_t column);
/// The unit in which they are times since 1970, of the years 1990 to 2150; nothing where there is none.
[[nodiscard]] std::optional<TimeUnit> unix_unit(const TimesSeen& times);

struct Mapping {
  TimeMap time;
  double gap_s = 0;  ///< Longer steps in time are gaps.
  std::vector<ChannelMap> channels;
  /// All that it names.
  [[nodiscard]] std::vector<std::string> columns() const;
};

/// @throws InputError naming file, key, value and bound.
[[nodiscard]] Mapping read_mapping(const std::string& path);

}  // namespace knuckle::recordings
