// Runs a battery's cells on all threads of all processes that share it (shards, MPI), and resumes it after an
// interruption. However the work is shared out, the rows are the same.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/battery/rows.h"
#include "app/cli/interrupt.h"
#include "app/cli/terminal.h"
#include "app/studies/sweep.h"

namespace knuckle::studies {

// Processes that share one piece of work: those that mpirun started, or this one alone. Built with MPI only where
// CMake's option KNUCKLE_MPI is on; without it, or without mpirun, there is one rank.
class Ranks {
 public:
  /// Joins the others, where mpirun (or srun) has started this process.
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  [[nodiscard]] int rank() const noexcept { return rank_; }
  [[nodiscard]] int size() const noexcept { return size_; }
  [[nodiscard]] bool first() const noexcept { return rank_ == 0; }
  /// Waits for all. @return the first of those that have failed; size() where none has.
  [[nodiscard]] int first_failed(bool failed) const;
  /// @throws std::length_error where gather() could not take so much.
  void check_length(const std::string& text) const;
  /// Ends all processes with this exit code: one has failed while the others are at work.
  [[noreturn]] void end_all(int code) const;
  /// Waits for all. @return on the first rank what each has given, by rank; elsewhere nothing.
  [[nodiscard]] std::vector<std::string> gather(const std::string& text) const;

 private:
  int rank_ = 0, size_ = 1;
};

struct SharedBattery {
  std::string title;  ///< Of the progress.
  battery::RowsKey key;
  std::function<void()> prepare;  ///< Before the first cell that this process runs.
  std::function<battery::Row(std::uint64_t)> run;
  std::function<int(const battery::Rows&)> finish;  ///< Writes what was asked for; the exit code.
};

/// Does `work` behind a bar of this title where it shows one, handing it a function that takes the share done, which
/// throws Interrupted once a signal has come. An InterruptGuard must live, as one does in all that run_shared() calls.
template <typename Work>
auto watched_where(bool shows, const std::string& title, const Work& work) {
  std::optional<cli::ProgressBar> bar;
  if (shows) bar.emplace(title);
  return work([&](double done) {
    cli::check_interrupt();
    if (bar) bar->show(done);
  });
}

/// @param open makes the battery; throws InputError on bad input. `writes` is true in the process that writes results.
/// @return the exit code. @throws Interrupted within about a second of a signal; complete rows are in their file then.
int run_shared(const SweepOptions& options, const std::function<SharedBattery(bool writes)>& open);

}  // namespace knuckle::studies
