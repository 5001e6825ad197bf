#include "app/recordings/csv_reader.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "core/error.h"
#include "core/quantile.h"
#include "core/units.h"

namespace knuckle::recordings {
namespace {

using Kind = Finding::Kind;

constexpr std::size_t kRowsInNotes = 40, kRowsInRefusal = 3;  // stretches of rows named
constexpr std::size_t kLeastRows = 4;                         // what a cubic through the data needs

/// One line for each kind of finding and column.
std::vector<std::string> described(const std::vector<Finding>& findings, std::size_t most_rows) {
  std::map<std::pair<Kind, std::string>, std::vector<std::size_t>> kinds;
  for (const Finding& f : findings) kinds[{f.kind, f.column}].push_back(f.row);
  std::vector<std::string> lines;
  for (const auto& [what, where] : kinds) {
    lines.push_back(std::to_string(where.size()) + " x " + name(what.first) +
                    (what.second.empty() ? "" : " in " + what.second) + ": row " + row_list(where, most_rows));
  }
  return lines;
}

/// A row whose time can be read.
struct TimedRow {
  std::size_t row;
  const Cells* cells;
  double time_s;
};

/// Indices of the longest strictly increasing subsequence of times; of equal times the first.
std::vector<std::size_t> increasing(const std::vector<TimedRow>& rows) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> ends, before(rows.size(), kNone);  // ends[n]: least last element of those of length n + 1
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto at = std::lower_bound(ends.begin(), ends.end(), rows[i].time_s,
                                     [&](std::size_t e, double t) { return rows[e].time_s < t; });
    if (at != ends.end() && rows[*at].time_s == rows[i].time_s) continue;
    if (at != ends.begin()) before[i] = *(at - 1);
    if (at == ends.end()) {
      ends.push_back(i);
    } else {
      *at = i;
    }
  }
  std::vector<std::size_t> kept;
  for (std::size_t i = ends.empty() ? kNone : ends.back(); i != kNone; i = before[i]) kept.push_back(i);
  std::reverse(kept.begin(), kept.end());
  return kept;
}

/// Fills one MappedTable from the rows of one file.
class Reader {
 public:
  Reader(CsvFile file, Mapping map) : map_(std::move(map)), file_(std::move(file)) {
    table_.source = file_.path;
    table_.gap_s = map_.gap_s;
    for (const ChannelMap& c : map_.channels) {
      columns_.push_back(column_index(file_, c.column));
      table_.channels.push_back({c.name, {}, c.column, c.factor, c.offset});
    }
    std::vector<std::size_t> numbers = columns_;
    if (timed()) time_column_ = column_index(file_, map_.time.column);
    if (timed() && map_.time.pattern.empty()) numbers.push_back(time_column_);
    find_decimal_mark(file_, numbers);
    if (const std::string style = file_.style(); !style.empty()) table_.notes.push_back("read as " + style);
    if (timed() && map_.time.pattern.empty()) judge_time_unit();
  }

  MappedTable read() {
    const std::vector<TimedRow> rows = in_order(timed_rows());
    judge_steps(rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const bool gap = i > 0 && rows[i].time_s - rows[i - 1].time_s > map_.gap_s;
      if (i > 0 && repeats(*rows[i].cells, *rows[i - 1].cells)) {
        found(Kind::kRepeatedRow, rows[i].row);
        held_ = held_ && !gap;
        if (held_) table_.until_s.back() = rows[i].time_s - rows.front().time_s;
        continue;
      }
      held_ = true;
      table_.time_s.push_back(rows[i].time_s - rows.front().time_s);
      table_.until_s.push_back(table_.time_s.back());
      table_.rows.push_back(rows[i].row);
      for (std::size_t c = 0; c < columns_.size(); ++c) {
        table_.channels[c].values.push_back(value_of(map_.channels[c], (*rows[i].cells)[columns_[c]], rows[i].row));
      }
    }
    std::stable_sort(table_.findings.begin(), table_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.row < b.row; });
    if (table_.time_s.size() < kLeastRows) {
      table_.refuse(std::to_string(table_.time_s.size()) + " usable rows of " + std::to_string(table_.rows_read) +
                    ", at least " + std::to_string(kLeastRows) + " are needed" + time_unit_doubt_);
    }
    return std::move(table_);
  }

 private:
  [[nodiscard]] bool timed() const { return map_.time.period_s <= 0; }
  void found(Kind kind, std::size_t row, const std::string& column = "") {
    table_.findings.push_back({kind, row, column});
  }

  /// Where the unit is not said it is found; where it is, doubts are kept for a refusal.
  void judge_time_unit() {
    const auto unit = unix_unit(times_seen(file_, time_column_));
    if (map_.time.factor == 0) {
      if (!unit)
        table_.refuse("column '" + map_.time.column +
                      "' is not in Unix time: the mapping must say its unit: s, ms, us or ns");
      map_.time.factor = unit->factor;
      table_.notes.push_back(map_.time.column + " is Unix time in " + unit->name);
    } else if (unit && unit->factor != map_.time.factor) {
      time_unit_doubt_ = std::string("; its times look like Unix time in ") + unit->name;
    }
  }

  std::vector<TimedRow> timed_rows() {
    std::vector<TimedRow> rows;
    const std::size_t width = file_.rows.front().size();
    // Delimiters at the end of the header, or of every other line, name nothing and hold nothing.
    std::size_t named = width;
    while (named > 0 && file_.rows.front()[named - 1].empty()) --named;
    for (std::size_t r = 1; r < file_.rows.size(); ++r) {
      Cells& row = file_.rows[r];
      if (std::all_of(row.begin(), row.end(), [](const std::string& c) { return c.empty(); })) continue;
      ++table_.rows_read;
      while (row.size() > width && row.back().empty()) row.pop_back();
      if (row.size() < named || row.size() > width) {
        found(Kind::kRaggedRow, r + 1);
        continue;
      }
      row.resize(width);
      const double t = timed() ? map_.time.seconds_in(row[time_column_], file_.decimal_mark)
                               : map_.time.period_s * static_cast<double>(table_.rows_read - 1);
      if (std::isfinite(t)) {
        rows.push_back({r + 1, &row, t});
      } else {
        found(row[time_column_].empty() ? Kind::kMissing : Kind::kNotANumber, r + 1, map_.time.column);
      }
    }
    return rows;
  }

  std::vector<TimedRow> in_order(const std::vector<TimedRow>& rows) {
    std::vector<TimedRow> kept;
    for (const std::size_t i : increasing(rows)) kept.push_back(rows[i]);
    const std::vector<std::size_t> strays = take_strays(kept);
    auto next = kept.begin();
    for (const TimedRow& r : rows) {
      if (next != kept.end() && next->row == r.row) {
        ++next;
        continue;
      }
      if (std::find(strays.begin(), strays.end(), r.row) != strays.end()) {
        found(Kind::kStrayTime, r.row, map_.time.column);
        continue;
      }
      const auto at = std::lower_bound(kept.begin(), kept.end(), r.time_s,
                                       [](const TimedRow& k, double t) { return k.time_s < t; });
      const bool known = at != kept.end() && at->time_s == r.time_s;
      found(known ? Kind::kRepeatedTime : Kind::kTimeOutOfOrder, r.row, map_.time.column);
    }
    return kept;
  }

  /// A few rows at an end whose clock was not set yet, or was written wrongly: the rest is the recording. Those in its
  /// midst are out of order. @return their rows in the file.
  [[nodiscard]] std::vector<std::size_t> take_strays(std::vector<TimedRow>& rows) const {
    constexpr std::size_t kMost = kLeastRows - 1;
    constexpr double kHour_s = 3600, kTimesTheRest = 10;
    std::vector<std::size_t> strays;
    const auto far = [&](double gap_s, double rest_s) {
      return gap_s > std::max(map_.gap_s, std::min(kTimesTheRest * rest_s, kHour_s));
    };
    for (std::size_t few = kMost; few > 0; --few) {
      if (rows.size() < few + kLeastRows) continue;
      const auto first = rows.begin() + static_cast<std::ptrdiff_t>(few);  // of the rest
      if (!far(first->time_s - (first - 1)->time_s, rows.back().time_s - first->time_s)) continue;
      for (auto row = rows.begin(); row != first; ++row) strays.push_back(row->row);
      rows.erase(rows.begin(), first);
      break;
    }
    for (std::size_t few = kMost; few > 0; --few) {
      if (rows.size() < few + kLeastRows) continue;
      const auto last = rows.end() - static_cast<std::ptrdiff_t>(few) - 1;
      if (!far((last + 1)->time_s - last->time_s, last->time_s - rows.front().time_s)) continue;
      for (auto row = last + 1; row != rows.end(); ++row) strays.push_back(row->row);
      rows.erase(last + 1, rows.end());
      break;
    }
    return strays;
  }

  /// Gaps, and steps in time far from the usual one.
  void judge_steps(const std::vector<TimedRow>& rows) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < rows.size(); ++i) steps.push_back(rows[i].time_s - rows[i - 1].time_s);
    if (steps.empty()) return;
    const double usual = median(steps);
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (steps[i] > map_.gap_s) {
        found(Kind::kGap, rows[i + 1].row, map_.time.column);
      } else if (std::abs(steps[i] - usual) > 0.5 * usual) {
        found(Kind::kUnevenStep, rows[i + 1].row, map_.time.column);
      }
    }
  }

  [[nodiscard]] bool repeats(const Cells& a, const Cells& b) const {
    for (std::size_t c = 0; c < a.size(); ++c) {
      if (a[c] != b[c] && !(timed() && c == time_column_)) return false;
    }
    return true;
  }

  double value_of(const ChannelMap& channel, const std::string& cell, std::size_t row) {
    const double value = file_.number(cell);
    if (cell.empty()) {
      found(Kind::kMissing, row, channel.column);
    } else if (!std::isfinite(value)) {
      found(Kind::kNotANumber, row, channel.column);
    } else if (channel.zero_is_drop_out && value == 0) {
      found(Kind::kDropOut, row, channel.column);
    } else if (value < channel.min || value > channel.max) {
      found(Kind::kOutOfRange, row, channel.column);
    } else {
      return value * channel.factor + channel.offset;
    }
    return kUnknown;
  }

  Mapping map_;
  CsvFile file_;
  std::string time_unit_doubt_;
  std::size_t time_column_ = 0;
  std::vector<std::size_t> columns_;
  bool held_ = true;  // no gap since the last row that was not a repetition
  MappedTable table_;
};

}  // namespace

const char* name(Finding::Kind kind) noexcept {
  static constexpr const char* kNames[] = {"row with another number of cells than the header (left out)",
                                           "repeated time (left out)",
                                           "time out of order (left out)",
                                           "time far from all others (left out)",
                                           "gap in time",
                                           "uneven step in time",
                                           "repeated row (left out)",
                                           "missing cell (not used)",
                                           "cell that is not a number (not used)",
                                           "drop-out (not used)",
                                           "value out of the mapping's range (not used)"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Kind::kCount));
  return kNames[static_cast<std::size_t>(kind)];
}

const MappedChannel& MappedTable::channel(const std::string& channel_name) const {
  for (const MappedChannel& c : channels) {
    if (c.name == channel_name) return c;
  }
  throw InputError(source + ": the mapping has no channel '" + channel_name + "'");
}

std::string row_list(const std::vector<std::size_t>& rows, std::size_t most) {
  std::string text;
  std::size_t stretches = 0;
  for (std::size_t i = 0, end; i < rows.size(); i = end) {
    if (stretches++ == most) return text + " and " + std::to_string(rows.size() - i) + " more";
    for (end = i + 1; end < rows.size() && rows[end] == rows[end - 1] + 1;) ++end;
    text += (i > 0 ? ", " : "") + std::to_string(rows[i]);
    if (end > i + 1) text += "-" + std::to_string(rows[end - 1]);
  }
  return text;
}

std::vector<std::string> MappedTable::report() const {
  std::vector<std::string> lines = described(findings, kRowsInNotes);
  lines.insert(lines.begin(),
               source + ": " + std::to_string(rows_read) + " rows, " + std::to_string(time_s.size()) + " used");
  lines.insert(lines.end(), notes.begin(), notes.end());
  return lines;
}

void MappedTable::refuse(const std::string& why) const {
  std::string text = source + ": " + why;
  for (const std::string& line : described(findings, kRowsInRefusal)) text += "; " + line;
  throw InputError(text);
}

MappedTable read_mapped_csv(const std::string& csv_path, const std::string& map_path) {
  return read_mapped_csv(csv_path, read_mapping(map_path));
}

MappedTable read_mapped_csv(const std::string& csv_path, const Mapping& mapping) {
  return read_mapped_csv(read_cells(csv_path, mapping.columns()), mapping);
}

MappedTable read_mapped_csv(CsvFile file, const Mapping& mapping) {
  return Reader(std::move(file), mapping).read();
}

}  // namespace knuckle::recordings
