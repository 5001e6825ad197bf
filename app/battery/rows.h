// The rows of a battery as they come, a line each, so that a run can be taken up where it ended and shards can be put
// together. The first line says which battery, program and files they belong to.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/battery/cell.h"
#include "app/battery/settings.h"

namespace knuckle::battery {

// What came of one cell of a battery: a line of JSON, the same wherever and whenever it ran.

/// Of a session: {"cell": index, "drawn": {...}, "effects": {...}, "metrics": {name: value or null}, "faults": [code],
/// "digest": hex, "failed": [criterion]}; or, where it could not run, with "refused": why instead of what came of it.
using Row = nlohmann::ordered_json;

/// Runs it. An input that is refused is an answer: the row says why.
[[nodiscard]] Row run_cell(const Cell& cell);
/// The same of a cell that is still to be drawn.
[[nodiscard]] Row run_cell(const Drawer& drawer, std::uint64_t index);

/// By a metric's name in criteria; nothing where the session could not measure it, or did not run.
[[nodiscard]] std::optional<double> metric_of(const Row& row, std::string_view metric);
[[nodiscard]] bool was_run(const Row& row);
[[nodiscard]] bool passed(const Row& row);

using Rows = std::map<std::uint64_t, Row>;  ///< By index.

/// Identifies the battery that a rows file belongs to.
struct RowsKey {
  nlohmann::ordered_json settings;  ///< An object: what the rows are drawn from.
  std::string fingerprint;          ///< Of the program and of the files that it reads.
  std::uint64_t cells = 0;          ///< Rows have indices below.
  std::function<bool(const Row&)> is_row;
};
/// Of a battery of sessions.
[[nodiscard]] RowsKey rows_key(const Settings& settings);
/// Of this program and of what is in `files`: rows of other ones are other rows.
[[nodiscard]] std::string fingerprint(const std::vector<std::string>& files);

/// Rows of a file, as far as it is whole: a last line that was cut off is none.
/// @throws InputError where the file is not of this battery, naming what differs, or cannot be read.
[[nodiscard]] Rows read_rows(const std::string& path, const RowsKey& key);

/// Rows are added to the file's end, one write each.
class RowsFile {
 public:
  /// Makes the file where it is missing, else keeps its rows. @throws InputError as read_rows, or where it cannot be
  /// written or another process writes to it.
  RowsFile(const std::string& path, const RowsKey& key);
  ~RowsFile();
  RowsFile(const RowsFile&) = delete;
  RowsFile& operator=(const RowsFile&) = delete;

  [[nodiscard]] const Rows& there() const noexcept { return there_; }
  /// From any thread. @throws InputError where the disk refuses it; later rows are then not kept.
  void add(const Row& row);

 private:
  void write(const std::string& line);
  [[noreturn]] void fail(int error) const;
  std::string path_;
  int descriptor_ = -1;
  off_t whole_ = 0;  ///< Length of what is whole.
  bool failed_ = false;
  Rows there_;
  std::mutex writing_;
};

}  // namespace knuckle::battery
