// One run of a wheel loader (config/maps/wheel_loader.toml) on a fixed period.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace knuckle::studies {

enum LoaderAxis { kLift, kTilt, kLoaderAxes };
inline constexpr std::array<const char*, kLoaderAxes> kLoaderAxisNames{"lift", "tilt"};

/// One value a sample in every channel; a cell that cannot be used holds the one before it.
struct LoaderRun {
  std::string source;
  double step_s = 0;
  std::array<std::vector<double>, kLoaderAxes> angle_rad, speed_radps, lever, force_MN;
  std::vector<double> engine_rps, drive_axle_rps, throttle, gear, digging;
  std::vector<std::string> report;  ///< What the reader found in the file.
  [[nodiscard]] std::size_t size() const noexcept { return engine_rps.size(); }
};

/// Reads every CSV of a folder, in the order of their names.
/// @throws InputError where there is none, or one cannot be used.
[[nodiscard]] std::vector<LoaderRun> load_loader_runs(const std::string& folder);

/// The period that makes the lift's summed speed agree with its angle: total least squares over stretches of 2 s, which
/// noise does not bias as it does differences of neighbouring rows.
[[nodiscard]] double period_from_motion(const LoaderRun& run);

}  // namespace knuckle::studies
