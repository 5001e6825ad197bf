#include "app/recordings/info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iostream>
#include <limits>
#include <numeric>
#include <optional>

#include "app/cli/interrupt.h"
#include "app/recordings/csv_reader.h"
#include "app/recordings/own_table.h"
#include "core/error.h"
#include "core/quantile.h"
#include "core/text.h"

namespace knuckle::recordings {

namespace {

constexpr std::size_t kMostColumns = 24, kMostFindings = 8;

/// Numbers of a column.
struct Extent {
  std::size_t count = 0;
  double least = std::numeric_limits<double>::infinity(), most = -std::numeric_limits<double>::infinity();
  void add(double value) {
    if (!std::isfinite(value)) return;
    ++count;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  [[nodiscard]] std::string text() const { return count == 0 ? "" : fmt::format("{:.6g} to {:.6g}", least, most); }
};

/// Lines of columns, as many as there is room for.
class ColumnLines {
 public:
  explicit ColumnLines(std::vector<std::string>& lines) : lines_(lines) {
    lines_.push_back(fmt::format("  {:<20} {:>10}  {:<28} {}", "column", "numbers", "least to largest", "is"));
  }
  void add(const std::string& column, const Extent& extent, const std::string& what) {
    if (++columns_ > kMostColumns) return;
    std::string line =
        fmt::format("  {:<20} {:>10}  {:<28} {}", shortened(column, 40), extent.count, extent.text(), what);
    line.erase(line.find_last_not_of(' ') + 1);
    lines_.push_back(std::move(line));
  }
  void end() const {
    if (columns_ > kMostColumns) lines_.push_back(fmt::format("  and {} more columns", columns_ - kMostColumns));
  }

 private:
  std::vector<std::string>& lines_;
  std::size_t columns_ = 0;
};

std::string utc(double unix_s) {
  return utc_text(static_cast<std::int64_t>(unix_s), "%Y-%m-%d %H:%M:%S");
}

/// @param from_s, to_s since 1970.
std::string time_range(double from_s, double to_s) {
  constexpr double k1980_s = 315'532'800, k2200_s = 7'258'118'400;
  if (from_s < k1980_s || to_s > k2200_s) return "time, not certain: not all are of 1980 to 2200";
  return fmt::format("time, {} to {} UTC", utc(from_s), utc(to_s));
}

void describe_read(const MappedTable& table, FileInfo& info) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < table.time_s.size(); ++i) steps.push_back(table.time_s[i] - table.time_s[i - 1]);
  info.lines.push_back(fmt::format("  time      {:.3f} s, usual step {:.4g} s", table.time_s.back(), median(steps)));
  ColumnLines columns(info.lines);
  for (const MappedChannel& channel : table.channels) {
    Extent extent;
    for (const double value : channel.values) extent.add(value);
    columns.add(channel.column, extent, channel.name);
  }
  columns.end();
  const std::vector<std::string> findings = table.report();
  for (std::size_t i = 1; i < findings.size(); ++i) {
    if (i > kMostFindings) {
      info.lines.push_back(fmt::format("  and {} more findings", findings.size() - i));
      break;
    }
    info.lines.push_back("  " + findings[i]);
  }
  if (findings.size() == 1) info.lines.emplace_back("  nothing wrong with it was found");
}

/// A column whose numbers only grow, and are called a time or stand first.
bool is_time(const std::string& name, std::size_t column, const std::vector<double>& numbers) {
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool called = lower == "t" || lower.starts_with("t_") || lower.find("time") != std::string::npos;
  return (called || column == 0) && numbers.size() > 1 && numbers.front() < numbers.back() &&
         std::is_sorted(numbers.begin(), numbers.end());
}

/// Columns as they stand, where nobody says what they are.
void describe_cells(CsvFile& file, FileInfo& info) {
  const Cells& header = file.rows.front();
  std::vector<std::size_t> all(header.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  try {
    find_decimal_mark(file, all);
  } catch (const InputError& doubt) {
    info.lines.push_back("  " + std::string(doubt.what()));
  }
  std::vector<std::string> lines;
  ColumnLines columns(lines);
  info.whole = false;  // until there is a number
  for (const std::size_t c : all) {
    if (header[c].empty()) continue;
    Extent extent;
    std::vector<double> numbers;
    for (std::size_t r = 1; r < file.rows.size(); ++r) {
      const double number = c < file.rows[r].size() ? file.number(file.rows[r][c]) : std::nan("");
      extent.add(number);
      if (std::isfinite(number)) numbers.push_back(number);
    }
    info.whole |= !numbers.empty();
    std::string what;
    if (is_time(header[c], c, numbers)) {
      const auto unit = unix_unit(times_seen(file, c));
      what = unit ? time_range(numbers.front() * unit->factor, numbers.back() * unit->factor) : "time perhaps";
    }
    columns.add(header[c], extent, what);
  }
  columns.end();
  info.lines.insert(info.lines.end(), lines.begin(), lines.end());
  info.lines.emplace_back(info.whole ? "  no table of Knuckle's own: --map FILE.toml says what its columns are"
                                     : "  cannot be used: no column has numbers");
}

}  // namespace

FileInfo table_info(const std::string& path, const std::string& map_path) {
  std::optional<Mapping> mapping;
  if (!map_path.empty()) mapping = read_mapping(map_path);
  CsvFile file = read_cells(path, mapping ? mapping->columns() : own_columns());
  const bool own = !mapping && has_own_columns(file);
  FileInfo info;
  const auto rows = static_cast<std::size_t>(
      std::count_if(file.rows.begin() + 1, file.rows.end(), [](const Cells& row) { return !row.empty(); }));
  const Cells& header = file.rows.front();
  const auto named = std::count_if(header.begin(), header.end(), [](const std::string& cell) { return !cell.empty(); });
  info.lines.push_back(fmt::format("{}: table, {}, {} rows, {} columns", path, size_of_file(path), rows, named));
  if (!own && !mapping) {
    describe_cells(file, info);
    if (const std::string style = file.style(); !style.empty()) info.lines[0] += "; " + style;
    return info;
  }
  try {
    MappedTable table = own ? read_own_table(std::move(file)) : read_mapped_csv(std::move(file), *mapping);
    forget_unmeasured(table);
    try {
      refuse_halfway_changes(table);
    } catch (const InputError&) {
      describe_read(table, info);
      throw;
    }
    describe_read(table, info);
  } catch (const InputError& refusal) {
    info.whole = false;
    info.lines.push_back("  cannot be used: " + std::string(refusal.what()));
  }
  return info;
}

namespace {

struct InfoOptions {
  std::vector<std::string> files;
  std::string map;
};

int run_info(const InfoOptions& o) {
  const cli::InterruptGuard interrupt;
  if (!o.map.empty()) cli::check_readable("--map", o.map);
  bool whole = true;
  for (const std::string& file : o.files) {
    if (is_recording(file) && !o.map.empty())
      cli::refuse_option("--map", o.map, "is of tables; " + file + " is a recording");
    const FileInfo info = is_recording(file) ? recording_info(file) : table_info(file, o.map);
    for (const std::string& line : info.lines) std::cout << line << '\n';
    whole = whole && info.whole;
  }
  return whole ? 0 : 1;
}

}  // namespace

cli::Command info_entry() {
  return cli::command<InfoOptions>(
      "info", "What is in recordings (.mcap) and tables (CSV), from when to when, and whether it is damaged",
      [](const cli::OptionList& command, InfoOptions& o) {
        command.add_option("FILE", o.files, "Recordings (.mcap) or tables (CSV)").required();
        command.add_option("--map", o.map, "Mapping file (.toml) of tables of other programs");
      },
      run_info);
}

}  // namespace knuckle::recordings
