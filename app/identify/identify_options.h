// The options of `knuckle identify`, checked before anything runs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/cli/command.h"

namespace knuckle::identify {

/// Empty strings mean "not requested"; "-" is standard output.
struct IdentifyOptions {
  std::vector<std::string> recordings;      ///< CSV files; none with simulate.
  std::string map;                          ///< Mapping file for foreign ones.
  std::string machine = "solar015";         ///< Name in config/machines or path of a .toml file.
  std::string method = "full";              ///< Or static, malaguti, kim.
  std::vector<std::string> hold_out_files;  ///< Recordings to validate on; else the last share of each recording.
  double hold_out_share = 0.25;
  std::string survey;  ///< CSV of surveyed poses: geometry first.
  double survey_sigma_mm = 1;
  bool simulate = false;             ///< Commission the simulated machine instead of reading recordings.
  std::uint64_t seed = 1;            ///< Draws its truth,
  std::string family, truth;         ///< from this family; or the truth's file.
  double slow_s = 120, fast_s = 80;  ///< Of the motions driven, here and by an ensemble.
  int ensemble = 0;                  ///< Simulated machines that the model's error is measured on.
  std::string record;                ///< Folder that keeps them as CSV.
  std::string out, report, json;
};

/// @param run gets options that are within their bounds and do not contradict each other; inputs can be read.
[[nodiscard]] cli::Command identify_entry(std::function<int(const IdentifyOptions&)> run);

}  // namespace knuckle::identify
