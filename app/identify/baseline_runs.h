// The two papers' experiments on the simulated machine, and what the simulator says their answers should have been.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "app/motion/machine_run.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::identify {

struct BaselineRuns {
  std::vector<motion::MachineRecording> identification, verification;
};

/// Drives the machine as the paper of `method` did: "static" 170 poses and 40 others to verify with, "malaguti" 40 s of
/// digging in the air and another 40 s to verify with, "kim" each joint slowly in turn and two verification runs.
/// @param machine as the controller of `run` sees it; @param seed of poses and digging.
/// @throws InputError for another method; std::runtime_error as MachineRun does.
[[nodiscard]] BaselineRuns run_baseline(const std::string& method, const MachineDescription& machine,
                                        motion::MachineRun& run, std::uint64_t seed);

[[nodiscard]] std::vector<estimation::Recording> recordings(const std::vector<motion::MachineRecording>& runs);

/// What the base parameters should be: projection of the torques that really moved the links on the regressor, along
/// these runs. The cylinders' masses, which have no place of their own in it, are spread as they showed.
[[nodiscard]] estimation::BaseParameters projected_parameters(const sim::MachineTruth& truth,
                                                              std::span<const motion::MachineRecording> runs);

/// True values by the names that `method` gives its parameters; what a simulated machine has no such thing of (a
/// friction at the joint) is left out. Projected along the verification where there is one.
/// @param machine as identified with: K's m2 and m3 are taken off as they were.
[[nodiscard]] std::map<std::string, double> baseline_truth(const std::string& method, const MachineDescription& machine,
                                                           const sim::MachineTruth& truth, const BaselineRuns& runs);

/// How M's inertias depend on noise and settings: one row a variant, over several sampled machines.
struct InertiaBias {
  std::string variant;
  std::vector<double> stick, bucket;  ///< Identified over true J2, J3, one a machine.
  int intervals = 0,
      covered = 0;  ///< Of the six inertial parameters: naive 95 % intervals that contain the true value.
};

/// @param progress done share in [0, 1]; may throw to end it.
/// Variants: the authors' settings on the sensors' values; on exact rod lengths; on those with 0.1 mm of noise;
/// a 2 Hz filter with a 41-sample cubic.
[[nodiscard]] std::vector<InertiaBias> malaguti_bias(const MachineDescription& machine, std::uint64_t first_seed,
                                                     int machines, const std::function<void(double)>& progress = {});

}  // namespace knuckle::identify
