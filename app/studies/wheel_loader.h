// A wheel loader's recorded run: valves as lever and speed show them, and its speeds one second ahead.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/studies/loader_run.h"
#include "app/studies/real_rows.h"

namespace knuckle::studies {

/// Valve and linkage of one axis as a Hammerstein model: speed = first-order lag of g(lever, delay ago).
struct LoaderValve {
  double dead_band = 0;           ///< Lever at which g leaves zero.
  double delay_s = 0, lag_s = 0;  ///< Transport delay, then time constant.
  double saturation = 0;          ///< Lever at which g has 95 % of its end value.
  double full_radps = 0;          ///< g at full lever.
  double full_per_MN = 0;         ///< Change of the speed at full lever per cylinder force, relative to full_radps.
  double explained = 0;           ///< Share of the variance of speed under lever, on the runs asked about.
};

/// Only the recorded direction (lift up, tilt back): the file's levers read zero while the machine lowers or dumps.
/// Fitted on `train`, `explained` on `test`: samples until shortly after the axis's lever was used in which nothing
/// else moves or stops it.
/// @throws InputError where the lever never moves.
[[nodiscard]] LoaderValve identify_loader_valve(std::span<const LoaderRun> train, std::span<const LoaderRun> test,
                                                LoaderAxis axis);

/// Everything a table of results needs: valves and one-second-ahead speeds, fitted on train_dir, judged on test_dir.
/// @param train_dir, test_dir folders with one CSV a run.
/// @throws InputError where a folder has no usable run.
[[nodiscard]] std::vector<RealRow> wheel_loader_rows(const std::string& train_dir, const std::string& test_dir);

}  // namespace knuckle::studies
