#include "app/studies/shared_battery.h"

#include <fmt/format.h>

#include <charconv>
#include <exception>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <sstream>
#include <vector>

#include "app/cli/command.h"
#include "app/identify/ensemble.h"
#include "core/error.h"

namespace knuckle::studies {
namespace {

using battery::Row;
using battery::Rows;

/// Every `of`-th cell from `first` on.
struct Shard {
  std::uint64_t first = 0, of = 1;
};

Shard parse_shard(const std::string& text) {
  if (text.empty()) return {};
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, k_error] = std::from_chars(text.data(), end, shard.first);
  const bool has_slash = k_error == std::errc() && slash != end && *slash == '/';
  const auto [rest, n_error] = std::from_chars(has_slash ? slash + 1 : end, end, shard.of);
  if (!has_slash || n_error != std::errc() || rest != end || shard.first < 1 || shard.first > shard.of ||
      shard.of > 100'000)
    cli::refuse_option("--shard", text, "must be K/N, such as 1/4, with 1 <= K <= N <= 100000");
  --shard.first;
  return shard;
}

/// @throws InputError where there is another row of the same cell already: a battery has one result.
void add(const std::string& source, std::uint64_t index, const Row& row, Rows& to) {
  const auto [there, added] = to.emplace(index, row);
  if (!added && there->second != row)
    throw InputError(fmt::format("{}: cell {}: differs from a row of the same cell read before", source, index));
}

void add(const std::string& source, const Rows& from, Rows& to) {
  for (const auto& [index, row] : from) add(source, index, row, to);
}

/// That some number of processes have written: FILE of one alone, FILE.0, FILE.1 ... of several.
std::vector<std::string> files_of_rows(const std::string& file) {
  std::vector<std::string> files;
  const auto holds_rows = [](const std::string& path) {
    std::error_code error;
    return std::filesystem::is_regular_file(path, error) && std::filesystem::file_size(path, error) > 0;
  };
  if (holds_rows(file)) files.push_back(file);
  for (int rank = 0; holds_rows(fmt::format("{}.{}", file, rank)); ++rank)
    files.push_back(fmt::format("{}.{}", file, rank));
  return files;
}

std::string lines_of(const Rows& rows) {
  std::string text;
  for (const auto& [index, row] : rows) text += row.dump() + '\n';
  return text;
}

void add_lines(const std::string& text, Rows& rows) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const Row row = Row::parse(line);
    add("another process", row["cell"].get<std::uint64_t>(), row, rows);
  }
}

/// What one process does of a battery.
class Share {
 public:
  /// Opens and reads everything, so that a bad input or place is known at once.
  Share(const SweepOptions& options, const Ranks& ranks, const std::function<SharedBattery(bool)>& open)
      : file_name_(options.rows.empty() || ranks.size() == 1 ? options.rows
                                                             : fmt::format("{}.{}", options.rows, ranks.rank())),
        jobs_(options.jobs),
        shows_(ranks.first()),
        shard_(parse_shard(options.shard)),
        battery_(open(ranks.first())) {
    shard_.first += shard_.of * static_cast<std::uint64_t>(ranks.rank());
    shard_.of *= static_cast<std::uint64_t>(ranks.size());
    for (const std::string& file : options.merge) add(file, battery::read_rows(file, battery_.key), rows_);
    if (options.rows.empty()) return;
    // Taken up by any number of processes.
    for (const std::string& file : files_of_rows(options.rows)) {
      if (file != file_name_) add(file, battery::read_rows(file, battery_.key), rows_);
    }
  }

  /// Once all have read what is there. One file for each process: files on a shared disk are not appended to by two
  /// computers.
  void open_file() {
    if (file_name_.empty()) return;
    file_.emplace(file_name_, battery_.key);
    add(file_name_, file_->there(), rows_);
  }

  void run() {
    const std::vector<std::uint64_t> cells = missing();
    if (cells.empty()) return;
    std::mutex adding;
    const auto all = [&](const auto& progress) {
      identify::parallel_for(
          cells.size(), jobs_,
          [&](std::size_t i) {
            const Row row = battery_.run(cells[i]);
            if (file_) file_->add(row);
            const std::scoped_lock lock(adding);
            rows_[cells[i]] = row;
          },
          progress);
    };
    try {
      if (battery_.prepare) battery_.prepare();
      watched_where(shows_, battery_.title, all);
    } catch (const cli::Interrupted&) {
      if (!file_) throw;
      throw cli::Interrupted(
          fmt::format("{} of {} cells are kept: the same command runs the others", rows_.size(), battery_.key.cells));
    }
  }

  [[nodiscard]] const Rows& rows() const noexcept { return rows_; }

  /// @param all rows of all processes, this one's too.
  int finish(const std::vector<std::string>& all) {
    for (const std::string& lines : all) add_lines(lines, rows_);
    return battery_.finish(rows_);
  }

 private:
  /// The cells that this process has to run.
  [[nodiscard]] std::vector<std::uint64_t> missing() const {
    std::vector<std::uint64_t> cells;
    for (std::uint64_t i = shard_.first; i < battery_.key.cells; i += shard_.of) {
      if (!rows_.contains(i)) cells.push_back(i);
    }
    return cells;
  }

  std::string file_name_;  // of this process's rows
  int jobs_;
  bool shows_;
  Shard shard_;
  SharedBattery battery_;
  std::optional<battery::RowsFile> file_;
  Rows rows_;
};

}  // namespace

int run_shared(const SweepOptions& options, const std::function<SharedBattery(bool)>& open) {
  const cli::InterruptGuard interrupt;  // from before the first output is opened
  const Ranks ranks;
  std::optional<Share> share;
  constexpr int kRefused = 2, kInterrupted = 130;
  // Whoever is refused at the start takes all along; one of them says why.
  const auto together = [&](const auto& work) {
    std::exception_ptr refusal;
    try {
      work();
    } catch (...) {
      refusal = std::current_exception();
    }
    const int first = ranks.first_failed(refusal != nullptr);
    if (first == ranks.rank()) std::rethrow_exception(refusal);
    return first == ranks.size();
  };
  if (!together([&] { share.emplace(options, ranks, open); }) || !together([&] { share->open_file(); }))
    return kRefused;
  std::string lines;
  try {
    share->run();
    lines = lines_of(share->rows());
    ranks.check_length(lines);
  } catch (const std::exception& error) {
    if (ranks.size() == 1) throw;
    // The others may have hours to go: their rows are in their files.
    std::cerr << "process " << ranks.rank() << ": " << error.what() << std::endl;
    ranks.end_all(dynamic_cast<const cli::Interrupted*>(&error) ? kInterrupted : kRefused);
  }
  const std::vector<std::string> all = ranks.gather(lines);
  return ranks.first() ? share->finish(all) : 0;
}

}  // namespace knuckle::studies
