// The commissioning of a machine by itself: survey, excitation through the valves, hold-out motion; then geometry,
// torques and valves from what was recorded. Driving and calibrating are apart, so that the second half is the same
// for recordings of any machine.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "app/motion/machine_run.h"
#include "estimation/identification/full.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/identification/valve_identification.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::identify {

struct CommissionPlan {
  std::size_t survey_poses = 20;
  double survey_sigma_m = 1e-3;
  double slow_s = 120, fast_s = 80;
  double validation_s = 40;                         ///< Each, slow and at digging speed.
  double survey_frame_rad = 0, survey_frame_m = 0;  ///< Bounds of how far the surveyor's axes are turned and shifted.
  /// What driving it takes, about.
  [[nodiscard]] double duration_s() const noexcept {
    constexpr double kPose_s = 5;  // there, come to rest
    return kPose_s * static_cast<double>(survey_poses) + slow_s + fast_s + 2 * validation_s;
  }
};

/// How well the surveyor finds the axes of machines of this family. Sources: sim/README.md.
void set_surveyor(sim::Family family, CommissionPlan& plan);

struct CommissionRuns {
  estimation::Survey survey;
  motion::MachineRecording slow, fast;
  motion::MachineRecording validation_slow, validation_digging;
};

/// Drives the simulated machine through its wires. @param progress done share in [0, 1]; may throw to end it.
/// @param posed called with the survey so far after each of its poses.
/// @throws std::runtime_error with the reason where the machine does not follow its commands.
[[nodiscard]] CommissionRuns run_commissioning(const MachineDescription& nominal, const sim::MachineTruth& truth,
                                               const CommissionPlan& plan, std::uint64_t seed,
                                               const std::function<void(double)>& progress = {},
                                               const std::function<void(const estimation::Survey&)>& posed = {});

struct Commissioned {
  estimation::GeometryResult geometry;
  estimation::ValveResult valves;
  estimation::FullResult full;
  MachineDescription machine;  ///< The drawing with whatever was usable in its calibrations; not yet calibrated().
};

struct CommissionOptions {
  bool calibrate_geometry = true;
  estimation::FullOptions full;
};
[[nodiscard]] Commissioned calibrate(const MachineDescription& nominal, const CommissionRuns& runs,
                                     const CommissionOptions& options);

// Its first and last step by themselves: what is usable goes into the machine.
/// Lengths and pins, on which angles and levers of everything else hang.
estimation::GeometryResult learn_geometry(MachineDescription& machine, const estimation::Survey& survey);
/// Valves, from recordings that hold their commands.
estimation::ValveResult learn_valves(MachineDescription& machine, std::span<const estimation::Recording> recordings);

}  // namespace knuckle::identify
