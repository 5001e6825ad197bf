#include "app/csv_reader.h"

#include <csv.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <sstream>

#include "core/error.h"
#include "machine/toml_reader.h"

namespace knuckle::app {
namespace {

using Cells = std::vector<std::string>;

struct ChannelMap {
  std::string name, column;
  double factor = 1, offset = 0;
  bool zero_is_drop_out = false;
};

struct TimeMap {
  std::string column, pattern;
  double factor = 1, period_s = 0;  // period_s > 0: rows are equally spaced
};

struct Mapping {
  TimeMap time;
  double gap_s = 0;
  std::vector<ChannelMap> channels;
};

std::string trimmed(std::string text) {
  const auto space = [](unsigned char c) { return std::isspace(c) != 0; };
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), space));
  text.erase(std::find_if_not(text.rbegin(), text.rend(), space).base(), text.end());
  return text;
}

std::vector<Cells> read_cells(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path + ": cannot be read");
  std::stringstream buffer;
  buffer << file.rdbuf();
  const std::string bytes = buffer.str();

  struct Sink {
    std::vector<Cells> rows;
    Cells row;
  } sink;
  csv_parser parser;
  if (csv_init(&parser, CSV_APPEND_NULL) != 0) throw InputError(path + ": cannot start the CSV parser");
  const std::unique_ptr<csv_parser, void (*)(csv_parser*)> guard(&parser, csv_free);
  const auto cell = [](void* data, std::size_t size, void* to) {
    static_cast<Sink*>(to)->row.push_back(trimmed(std::string(static_cast<const char*>(data), size)));
  };
  const auto end = [](int, void* to) {
    auto* s = static_cast<Sink*>(to);
    s->rows.push_back(std::move(s->row));
    s->row.clear();
  };
  if (csv_parse(&parser, bytes.data(), bytes.size(), cell, end, &sink) != bytes.size()) {
    throw InputError(path + ": row " + std::to_string(sink.rows.size() + 1) + ": " + csv_strerror(csv_error(&parser)));
  }
  csv_fini(&parser, cell, end, &sink);
  if (sink.rows.size() < 2) throw InputError(path + ": no rows below the header");
  return std::move(sink.rows);
}

Mapping read_mapping(const std::string& path) {
  struct Unit {
    const char* name;
    double factor;
  };
  static constexpr Unit kUnits[] = {{"rad", 1}, {"deg", std::numbers::pi / 180}, {"m", 1}, {"mm", 1e-3}, {"bar", 1e5},
                                    {"Pa", 1}};
  TomlTable file = TomlTable::read(path);
  Mapping map;
  TomlTable time = file.table("time");
  map.gap_s = time.number("gap_s", 1e-3, 1e3);
  if (time.has("period_s")) {
    map.time.period_s = time.number("period_s", 1e-4, 10);
  } else {
    map.time.column = time.text("column");
    if (time.has("pattern")) {
      map.time.pattern = time.text("pattern");
      time.require(map.time.pattern.find("YYYYMMDD_HHMMSS") != std::string::npos, "pattern",
                   "must hold YYYYMMDD_HHMMSS, with .mmm behind it for milliseconds");
    } else {
      map.time.factor = time.choice("unit", {"s", "ms"}) == 0 ? 1.0 : 1e-3;
    }
  }
  for (TomlTable& entry : file.tables("channel")) {
    ChannelMap channel;
    channel.name = entry.text("name");
    channel.column = entry.text("column");
    const int unit = entry.choice("unit", {"rad", "deg", "m", "mm", "bar", "Pa"});
    const double sign = entry.number("sign", -1, 1);
    entry.require(std::abs(sign) == 1, "sign", "must be 1 or -1");
    channel.factor = kUnits[unit].factor * sign;
    channel.offset = entry.number("offset", -1e6, 1e6) * kUnits[unit].factor;
    channel.zero_is_drop_out = entry.has("zero_is_drop_out") && entry.boolean("zero_is_drop_out");
    map.channels.push_back(channel);
  }
  file.require(!map.channels.empty(), "channel", "at least one [[channel]] is needed");
  file.finish();
  return map;
}

std::size_t column_index(const Cells& header, const std::string& column, const std::string& csv_path) {
  const auto it = std::find(header.begin(), header.end(), column);
  if (it == header.end()) throw InputError(csv_path + ": row 1: no column '" + column + "' as the mapping asks");
  return static_cast<std::size_t>(it - header.begin());
}

double number_in(const std::string& cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = error == std::errc() && end == cell.data() + cell.size();
  return whole && std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
}

/// Seconds of the date-time that `pattern` describes, searched for anywhere in the cell; NaN where there is none.
double date_time_in(const std::string& cell, const std::string& pattern) {
  const bool milliseconds = pattern.find(".mmm") != std::string::npos;
  for (std::size_t at = 0; at + 15 <= cell.size(); ++at) {
    int year, month, day, hour, minute, second, used = 0;
    if (std::sscanf(cell.c_str() + at, "%4d%2d%2d_%2d%2d%2d%n", &year, &month, &day, &hour, &minute, &second, &used) !=
            6 ||
        used != 15) {
      continue;
    }
    const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                           std::chrono::day(static_cast<unsigned>(day))};
    if (!date.ok() || hour > 23 || minute > 59 || second > 60) continue;
    double s = 86400.0 * static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) + 3600.0 * hour +
               60.0 * minute + second;
    if (milliseconds) {
      const double fraction = number_in("0" + cell.substr(at + 15, 4));
      if (!std::isfinite(fraction)) continue;
      s += fraction;
    }
    return s;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

double time_of(const TimeMap& map, const Cells& cells, std::size_t column, std::size_t index) {
  if (map.period_s > 0) return map.period_s * static_cast<double>(index);
  if (column >= cells.size()) return std::numeric_limits<double>::quiet_NaN();
  return map.pattern.empty() ? number_in(cells[column]) * map.factor : date_time_in(cells[column], map.pattern);
}

}  // namespace

const char* name(Finding::Kind kind) noexcept {
  switch (kind) {
    case Finding::Kind::kRepeatedRow:
      return "repeated row";
    case Finding::Kind::kRepeatedTime:
      return "repeated time";
    case Finding::Kind::kBackwardTime:
      return "time running backward";
    case Finding::Kind::kMissing:
      return "missing cell";
    case Finding::Kind::kNotANumber:
      return "cell that is not a number";
    case Finding::Kind::kDropOut:
      return "drop-out";
    case Finding::Kind::kGap:
      return "gap in time";
  }
  return "";
}

const MappedChannel& MappedTable::channel(const std::string& channel_name) const {
  for (const MappedChannel& c : channels) {
    if (c.name == channel_name) return c;
  }
  throw InputError(source + ": the mapping has no channel '" + channel_name + "'");
}

std::string MappedTable::summary() const {
  struct Count {
    std::size_t n = 0, first = 0;
  };
  std::map<Finding::Kind, Count> counts;
  for (const Finding& f : findings) {
    Count& c = counts[f.kind];
    if (c.n++ == 0) c.first = f.row;
  }
  std::string line = std::to_string(rows_read) + " rows, " + std::to_string(time_s.size()) + " used";
  for (const auto& [kind, count] : counts) {
    line += "; " + std::to_string(count.n) + " x " + name(kind) + " (first: row " + std::to_string(count.first) + ")";
  }
  return line;
}

MappedTable read_mapped_csv(const std::string& csv_path, const std::string& map_path) {
  const Mapping map = read_mapping(map_path);
  const std::vector<Cells> cells = read_cells(csv_path);
  const Cells& header = cells.front();
  const bool timed = map.time.period_s <= 0;
  const std::size_t time_column = timed ? column_index(header, map.time.column, csv_path) : 0;
  std::vector<std::size_t> columns;
  MappedTable table;
  table.source = csv_path;
  for (const ChannelMap& c : map.channels) {
    columns.push_back(column_index(header, c.column, csv_path));
    table.channels.push_back({c.name, {}});
  }
  double first_s = 0;
  for (std::size_t r = 1; r < cells.size(); ++r) {
    const Cells& row = cells[r];
    const std::size_t line = r + 1;
    if (row.size() == 1 && row[0].empty()) continue;
    ++table.rows_read;
    const auto found = [&](Finding::Kind kind, const std::string& column) {
      table.findings.push_back({kind, line, column});
    };
    if (r > 1 && row == cells[r - 1]) {
      found(Finding::Kind::kRepeatedRow, "");
      continue;
    }
    const double t = time_of(map.time, row, time_column, r - 1);
    if (!std::isfinite(t)) {
      found(Finding::Kind::kNotANumber, map.time.column);
      continue;
    }
    if (table.time_s.empty()) first_s = t;
    const double since = t - first_s;
    if (!table.time_s.empty() && since <= table.time_s.back()) {
      found(since == table.time_s.back() ? Finding::Kind::kRepeatedTime : Finding::Kind::kBackwardTime,
            map.time.column);
      continue;
    }
    if (!table.time_s.empty() && since - table.time_s.back() > map.gap_s) found(Finding::Kind::kGap, map.time.column);
    table.time_s.push_back(since);
    table.rows.push_back(line);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const ChannelMap& channel = map.channels[c];
      double value = std::numeric_limits<double>::quiet_NaN();
      if (columns[c] >= row.size() || row[columns[c]].empty()) {
        found(Finding::Kind::kMissing, channel.column);
      } else if (value = number_in(row[columns[c]]); !std::isfinite(value)) {
        found(Finding::Kind::kNotANumber, channel.column);
      } else if (channel.zero_is_drop_out && value == 0) {
        found(Finding::Kind::kDropOut, channel.column);
        value = std::numeric_limits<double>::quiet_NaN();
      }
      table.channels[c].values.push_back(value * channel.factor + channel.offset);
    }
  }
  if (table.time_s.size() < 4) {
    throw InputError(csv_path + ": " + std::to_string(table.time_s.size()) + " usable rows; at least 4 are needed (" +
                     table.summary() + ")");
  }
  return table;
}

}  // namespace knuckle::app
