// What both papers' sections of the page share: cells of its tables, and what the two methods make of a recording. Each
// table has a column for what the paper prints, one for its authors' method and one for the default method, both on the
// same recordings of the simulated machine.
#pragma once

#include <cmath>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "app/identify/baseline_report.h"
#include "app/report/html.h"
#include "app/report/result_text.h"
#include "app/studies/offline_estimator.h"
#include "app/studies/papers.h"
#include "core/filters.h"
#include "estimation/force_estimator.h"
#include "estimation/identification/baseline.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::studies {

using TableRows = std::vector<std::vector<std::string>>;
inline constexpr const char* kNotShown = "not shown";
inline constexpr const char* kNone = "-";

/// One paper's part of the page. @return the rows that sum it up.
[[nodiscard]] TableRows write_malaguti(const MalagutiRepeated& repeated, std::ostream& out);
[[nodiscard]] TableRows write_kim(const Experiment& slow, std::ostream& out);

[[nodiscard]] TableRows result_head();
[[nodiscard]] std::string percent(double share);
/// A torque or force to a tenth of its unit.
[[nodiscard]] std::string tenths(double value);
[[nodiscard]] std::string recorded_s(const std::vector<estimation::Recording>& recordings);
/// Above a paper's tables: what was done.
void write_experiment(std::ostream& out, const std::vector<std::string>& paragraphs);
[[nodiscard]] std::string verdicts(const Experiment& experiment);

// Parameters of the default method in the papers' terms.

/// To two digits of the standard deviation.
[[nodiscard]] std::string with_sigma(double value, double sigma);
/// @param gradient of the value to the default method's parameters.
[[nodiscard]] std::string with_sigma(const identify::Identified& ours, double value, const CalibrationVector& gradient);
[[nodiscard]] std::string parameter(const identify::Identified& ours, int index);
/// What both directions have in common; the rest is mostly the transmitters' offset.
[[nodiscard]] std::string coulomb(const identify::Identified& ours, int joint);
/// A row for each of `ours`, in the order of the paper's table.
[[nodiscard]] TableRows parameter_rows(identify::Paper paper,
                                       const std::vector<estimation::IdentifiedParameter>& theirs,
                                       const std::vector<std::string>& ours,
                                       const std::map<std::string, double>& truth);

// Torques of one recording by both methods.

struct Torques {
  estimation::TorqueComparison theirs, ours;
  estimation::TorqueFit their_fit, our_fit;
};

/// @param cutoff_Hz up to which theirs is given, so that ours is judged likewise; 0: unfiltered.
template <typename Result>
Torques torques(const Experiment& experiment, const Result& result, const estimation::Recording& recording,
                double cutoff_Hz) {
  const MachineDescription machine = calibrated(experiment.data.machine);
  Torques both{compare_torque(result, machine, recording),
               estimation::compare_torque(*experiment.ours.machine.dynamics_calibration, machine, recording),
               {},
               {}};
  if (cutoff_Hz > 0) both.ours = estimation::low_passed(both.ours, cutoff_Hz);
  both.their_fit = torque_fit(both.theirs, 0);
  both.our_fit = torque_fit(both.ours, 0);
  return both;
}

// Forces at the tip of the empty bucket.

/// What the running estimator, calibrated by the default method, makes of each held-out recording, one after the other,
/// once it has run over the recordings that were identified from. Not valid without a usable calibration, which no
/// machine would run with.
[[nodiscard]] std::vector<std::vector<EstimateSample>> estimates(const Experiment& experiment);

/// @param solve of estimation/identification/baseline.h. @return one answer a sample, NaN where there is none.
template <typename Solve>
auto solved(const MachineDescription& machine, const std::vector<EstimateSample>& samples, Solve solve) {
  const Kinematics kinematics(machine);
  using Answer = decltype(solve({}, {}, {}));
  std::vector<Answer> answers(samples.size(), Answer::Constant(std::nan("")));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const estimation::JointLoad& load = samples[i].load;
    if (samples[i].valid) answers[i] = solve(kinematics.tip_jacobian(load.joint_rad), load.joint_rad, load.torque_Nm);
  }
  return answers;
}

[[nodiscard]] std::vector<PlanarVector> tip_forces(const std::vector<EstimateSample>& samples);

/// As slow as the reported force of the default method is.
template <typename Vector>
std::vector<Vector> slowed(std::vector<Vector> values, double step_s) {
  LowPass<Vector> filter(estimation::kSlowBand.observer_Hz, step_s, Vector::Zero());
  bool started = false;
  for (Vector& value : values) {
    const bool known = value.allFinite();
    if (known && !started) filter.reset(value);
    if (known) value = filter.step(value);
    started = known;
  }
  return values;
}

}  // namespace knuckle::studies
