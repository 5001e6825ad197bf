// Runs a battery's cells on all threads of all processes that share it (shards, MPI), and resumes it after an
// interruption. However the work is shared out, the rows are the same.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "app/battery/rows_file.h"
#include "app/studies/sweep_options.h"

namespace knuckle::studies {

struct SharedBattery {
  std::string title;  ///< Of the progress.
  battery::RowsKey key;
  std::function<void()> prepare;  ///< Before the first cell that this process runs.
  std::function<battery::Row(std::uint64_t)> run;
  std::function<int(const battery::Rows&)> finish;  ///< Writes what was asked for; the exit code.
};

/// @param open makes the battery; throws InputError on bad input. `writes` is true in the process that writes results.
/// @return the exit code.
int run_shared(const SweepOptions& options, const std::function<SharedBattery(bool writes)>& open);

}  // namespace knuckle::studies
