// A mapping file: which column of a foreign CSV holds which Knuckle channel, in what unit, sign and offset, and how its
// time is written.
#pragma once

#include <string>
#include <string_view>
#include <vector>

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
  double factor = 1;    ///< Seconds a unit of the column.
  double period_s = 0;  ///< Above 0: rows are equally spaced and there is no column.
  /// Seconds, of a cell; NaN where it holds no time within 1e12 s. With a pattern counted from 1970-01-01.
  [[nodiscard]] double seconds_in(const std::string& cell) const;
};

struct Mapping {
  TimeMap time;
  double gap_s = 0;  ///< Longer steps in time are gaps.
  std::vector<ChannelMap> channels;
};

/// @throws InputError naming file, key, value and bound.
[[nodiscard]] Mapping read_mapping(const std::string& path);

/// The whole cell as a finite number, else NaN.
[[nodiscard]] double number_in(std::string_view cell);

}  // namespace knuckle::recordings
