// The command `knuckle-studies sweep`: batteries of sampled machines and drawn sessions, on all processors, in shards
// and under MPI.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/command.h"

namespace knuckle::studies {

struct SweepOptions {
  std::string battery, json;
  std::optional<std::string> machine, family;  ///< Not given: the battery's own.
  std::optional<std::uint64_t> seed;
  int jobs = 0;
  std::string shard;               ///< "K/N"; empty: all.
  std::string rows;                ///< File.
  std::vector<std::string> merge;  ///< Rows of other runs.
  // estimation
  int machines = 20, ensemble = 40, ablation = 0, budget = 0, running = 0;
  double from_tip_m = 0;
  // sessions: feel, work
  std::string grid;  ///< Empty: of the battery's name.
  std::optional<std::uint64_t> sessions;
  std::optional<std::string> person, control;
  std::string csv, report;  ///< Files.
};

/// Batteries of drawn sessions. @return the exit code: 0 where every session ran. Its figures are a judgement, not a
/// test: no bound is applied.
int run_session_sweep(const SweepOptions& options);
/// Many sampled machines, each commissioned, identified and judged by what its force estimate is worth. @return the
/// exit code: 1 where a machine failed or a target was missed.
int run_estimation_sweep(const SweepOptions& options);

[[nodiscard]] cli::Command sweep_entry();

}  // namespace knuckle::studies
