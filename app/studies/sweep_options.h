// The options of `knuckle-studies sweep`, for all batteries.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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
  int machines = 20, ensemble = 40, ablation = 0, budget = 0;
  double from_tip_m = 0;
  // sessions: feel, work
  std::string grid;  ///< Empty: of the battery's name.
  std::optional<std::uint64_t> sessions;
  std::optional<std::string> person, control;
  std::string csv, report;  ///< Files.
};

}  // namespace knuckle::studies
