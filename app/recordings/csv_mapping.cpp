#include "app/recordings/csv_mapping.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>

#include "core/quantile.h"
#include "core/units.h"
#include "machine/toml_reader.h"

namespace knuckle::recordings {
namespace {

constexpr double kAnyTime_s = 1e12;  // beyond it no step in time would be told from another

constexpr double kPsi_Pa = 6894.757293168;

/// Fields of a date and time in the order of their letters in a pattern: YYYY, MM, DD, HH, MM, SS, mmm.
enum DatePart { kYear, kMonth, kDay, kHour, kMinute, kSecond, kFraction, kFieldCount };

/// The field that a pattern's letter starts; MM is the month before HH and the minute behind it.
std::optional<DatePart> field_of(char letter, bool hour_seen) {
  switch (letter) {
    case 'Y':
      return kYear;
    case 'M':
      return hour_seen ? kMinute : kMonth;
    case 'D':
      return kDay;
    case 'H':
      return kHour;
    case 'S':
      return kSecond;
    case 'm':
      return kFraction;
    default:
      return std::nullopt;
  }
}

std::size_t run_length(std::string_view text, std::size_t at) {
  const std::size_t end = text.find_first_not_of(text[at], at);
  return (end == std::string_view::npos ? text.size() : end) - at;
}

bool pattern_is_whole(const std::string& pattern) {
  std::array<bool, kFieldCount> seen{};
  for (std::size_t at = 0; at < pattern.size(); at += run_length(pattern, at)) {
    if (const auto field = field_of(pattern[at], seen[kHour])) seen[*field] = true;
  }
  return std::all_of(seen.begin(), seen.begin() + kFraction, [](bool s) { return s; });
}

/// Seconds since 1970 of text that starts with a date and time as the pattern says; NaN where it does not.
double date_time_at(std::string_view text, const std::string& pattern) {
  std::array<int, kFieldCount> value{};
  double fraction_unit = 1;
  bool hour_seen = false;
  for (std::size_t at = 0, length; at < pattern.size(); at += length) {
    length = run_length(pattern, at);
    if (at + length > text.size()) return kUnknown;
    const auto field = field_of(pattern[at], hour_seen);
    if (!field) {
      if (text.substr(at, length) != std::string_view(pattern).substr(at, length)) return kUnknown;
      continue;
    }
    const std::string_view digits = text.substr(at, length);
    if (digits.find_first_not_of("0123456789") != std::string_view::npos) return kUnknown;
    std::from_chars(digits.data(), digits.data() + length, value[*field]);
    if (*field == kFraction) fraction_unit = std::pow(10.0, -static_cast<double>(length));
    hour_seen = hour_seen || *field == kHour;
  }
  const std::chrono::year_month_day date{std::chrono::year(value[kYear]),
                                         std::chrono::month(static_cast<unsigned>(value[kMonth])),
                                         std::chrono::day(static_cast<unsigned>(value[kDay]))};
  if (!date.ok() || value[kHour] > 23 || value[kMinute] > 59 || value[kSecond] > 60) return kUnknown;
  const auto days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
  return 86400 * days + 3600 * value[kHour] + 60 * value[kMinute] + value[kSecond] + fraction_unit * value[kFraction];
}

TimeMap read_time(TomlTable& file) {
  TimeMap time;
  if (file.has("period_s")) {
    time.period_s = file.number("period_s", 1e-4, 10);
    return time;
  }
  time.column = file.text("column");
  if (file.has("pattern")) {
    time.pattern = file.text("pattern");
    file.require(pattern_is_whole(time.pattern), "pattern",
                 "must hold YYYY, MM, DD, HH, MM and SS, and mmm for milliseconds: YYYYMMDD_HHMMSS.mmm");
  } else if (file.has("unit")) {
    time.factor = kTimeUnits[static_cast<std::size_t>(file.choice("unit", {"s", "ms", "us", "ns"}))].factor;
  } else {
    time.factor = 0;
  }
  return time;
}

ChannelMap read_channel(TomlTable& entry) {
  static constexpr std::array kUnitFactors{1.0, kDegree, 1.0, 1e-3, 1e5, 1.0, 1e3, 1e6, kPsi_Pa, 1.0, 0.01};
  ChannelMap channel;
  channel.name = entry.text("name");
  channel.column = entry.text("column");
  const int unit = entry.choice("unit", {"rad", "deg", "m", "mm", "bar", "Pa", "kPa", "MPa", "psi", "1", "%"});
  const double sign = entry.number("sign", -1e300, 1e300);
  entry.require(std::abs(sign) == 1, "sign", "must be 1 or -1");
  const double factor = kUnitFactors[static_cast<std::size_t>(unit)];
  channel.factor = factor * sign;
  channel.offset = entry.number("offset", -1e6, 1e6, factor);
  channel.min = entry.has("min") ? entry.number("min", -kAnyCell, kAnyCell) : -kAnyCell;
  const double least = entry.sound({"min"}) ? channel.min : -kAnyCell;
  channel.max = entry.has("max") ? entry.number("max", least, kAnyCell) : kAnyCell;
  channel.zero_is_drop_out = entry.has("zero_is_drop_out") && entry.boolean("zero_is_drop_out");
  return channel;
}

}  // namespace

TimesSeen times_seen(const CsvFile& file, std::size_t column) {
  std::vector<double> times, steps;
  for (std::size_t r = 1; r < file.rows.size(); ++r) {
    const double time = column < file.rows[r].size() ? file.number(file.rows[r][column]) : kUnknown;
    if (!std::isfinite(time)) continue;
    if (!times.empty() && time > times.back()) steps.push_back(time - times.back());
    times.push_back(time);
  }
  return {times.empty() ? kUnknown : median(times), steps.empty() ? kUnknown : median(steps)};
}

std::optional<TimeUnit> unix_unit(const TimesSeen& times) {
  constexpr double kYear_s = 365.25 * 86400, kLongestStep_s = 1000;
  for (const TimeUnit& unit : kTimeUnits) {
    const double since_s = times.middle * unit.factor;
    if (since_s >= 20 * kYear_s && since_s <= 180 * kYear_s && times.step * unit.factor <= kLongestStep_s) return unit;
  }
  return std::nullopt;
}

double TimeMap::seconds_in(const std::string& cell, char decimal_mark) const {
  if (pattern.empty()) {
    const double s = number_in(cell, decimal_mark) * factor;
    return std::abs(s) <= kAnyTime_s ? s : kUnknown;
  }
  for (std::size_t at = 0; at + pattern.size() <= cell.size(); ++at) {
    const double s = date_time_at(std::string_view(cell).substr(at), pattern);
    if (std::isfinite(s)) return s;
  }
  return kUnknown;
}

std::vector<std::string> Mapping::columns() const {
  std::vector<std::string> columns;
  if (!time.column.empty()) columns.push_back(time.column);
  for (const ChannelMap& channel : channels) columns.push_back(channel.column);
  return columns;
}

Mapping read_mapping(const std::string& path) {
  TomlTable file = TomlTable::read_kind("mapping", path);
  Mapping map;
  TomlTable time = file.table("time");
  map.gap_s = time.number("gap_s", 1e-3, 1e3);
  map.time = read_time(time);
  for (TomlTable& entry : file.tables("channel")) {
    map.channels.push_back(read_channel(entry));
    const auto same = [&](const ChannelMap& c) { return c.name == map.channels.back().name; };
    entry.require(std::count_if(map.channels.begin(), map.channels.end(), same) == 1, "name", "is there twice");
  }
  file.require(!map.channels.empty(), "channel", "at least one [[channel]] is needed");
  file.finish();
  return map;
}

}  // namespace knuckle::recordings
