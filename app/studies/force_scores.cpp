#include "app/studies/force_scores.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <variant>

#include "app/studies/offline_estimator.h"
#include "core/joints.h"
#include "core/quantile.h"
#include "core/units.h"
#include "estimation/contact_models.h"
#include "machine/description.h"
#include "machine/description_fwd.h"

namespace knuckle::studies {
namespace {

// The contact models beside the tip force, on the same known pulls.

PlanarVector no_answer() {
  return PlanarVector::Constant(kUnknown);
}

Row model_metrics(const std::vector<PressScore>& presses) {
  std::vector<double> answered;
  for (const PressScore& press : presses) answered.push_back(std::isnan(press.error_N) ? 0 : 1);
  Row metrics;
  metrics["answered"] = metric(answered);
  add_presses(presses, metrics);
  return metrics;
}

/// Metrics by model: tip_wrench, tip_force_of_two at the tip, force_and_position with the direction given. Of each,
/// answered (0 or 1: a pull may be refused) and those of its pulls (force_scores.h); of tip_wrench torque_Nm about the
/// tip, where there is none; of force_and_position place_error_m along the bucket.
/// @param machine as the estimator sees it; @param pulls its answers to trials.pulls.
Row score_contact_models(const MachineDescription& machine, const Trials& trials,
                         const std::vector<EstimateSample>& pulls) {
  const JointVector length_m(machine.links[0].length_m, machine.links[1].length_m, machine.links[2].length_m);
  std::vector<PressScore> wrenches, forces, places;
  std::vector<double> torque_Nm, place_error_m;
  for (const Press& press : trials.presses) {
    const std::size_t last = press.judge_to - 1;
    const PlanarVector truth = trials.pulls.truth[last].contact_N;
    const estimation::JointLoad& load = pulls[last].load;
    const auto score = [&](const PlanarVector& answer) { return score_pull(truth, answer, press.creeping); };

    const auto wrench = estimation::tip_wrench(length_m, load);
    const auto* three = std::get_if<estimation::TipWrench>(&wrench);
    wrenches.push_back(score(three != nullptr ? PlanarVector(three->wrench.head<2>()) : no_answer()));
    if (three != nullptr) torque_Nm.push_back(std::abs(three->wrench[2]));

    const auto force = estimation::tip_force_of_two(length_m, load, length_m[kBucket]);
    const auto* two = std::get_if<estimation::TwoJointForce>(&force);
    forces.push_back(score(two != nullptr ? two->force_N : no_answer()));

    const auto place = estimation::force_and_position(length_m, load, truth);
    const auto* at = std::get_if<estimation::ForceAtPlace>(&place);
    places.push_back(score(at != nullptr ? PlanarVector(at->force_N * truth.normalized()) : no_answer()));
    if (at != nullptr) place_error_m.push_back(std::abs(at->place_m - length_m[kBucket]));
  }
  Row models{{"tip_wrench", model_metrics(wrenches)},
             {"tip_force_of_two", model_metrics(forces)},
             {"force_and_position", model_metrics(places)}};
  models["tip_wrench"]["torque_Nm"] = metric(torque_Nm);
  models["force_and_position"]["place_error_m"] = metric(place_error_m);
  return models;
}

constexpr double kSettle_s = 1.0;  // filters start at each recording's beginning
constexpr double kLookEvery_s = 0.5;
constexpr double kLeastTaken = 0.1;  // of a pull, for a load

void add_norms(const std::string& motion, const std::vector<PlanarVector>& forces, double step_s, Row& metrics) {
  std::vector<double> sizes;
  for (auto k = static_cast<std::size_t>(kSettle_s / step_s); k < forces.size(); ++k) {
    if (forces[k].allFinite()) sizes.push_back(forces[k].norm());
  }
  double squares = 0;
  for (const double size : sizes) squares += size * size;
  metrics[motion + "_rms_N"] = metric(std::sqrt(squares / static_cast<double>(sizes.size())));
  metrics[motion + "_p95_N"] = metric(quantile(sizes, 0.95));
}

std::vector<PlanarVector> tips(const std::vector<EstimateSample>& samples) {
  std::vector<PlanarVector> result;
  result.reserve(samples.size());
  for (const EstimateSample& sample : samples) {
    result.push_back(sample.valid ? sample.tip_N : PlanarVector::Constant(kUnknown));
  }
  return result;
}

PressScore judge_press(const Trials& trials, const Press& press, const std::vector<PlanarVector>& forces) {
  PlanarVector truth = PlanarVector::Zero(), estimate = PlanarVector::Zero();
  const std::size_t end = std::min(press.judge_to, forces.size());
  for (std::size_t k = press.judge_from; k < end; ++k) {
    truth += trials.pulls.truth[k].contact_N;
    estimate += forces[k];
  }
  const double n = static_cast<double>(end - press.judge_from);
  return score_pull(truth / n, estimate / n, press.creeping);
}

/// Of free motion.
struct FreeMotion {
  int alarms = 0, looks = 0, covered = 0;
  double time_s = 0;
  void add(const motion::MachineRecording& run, const std::vector<EstimateSample>& estimates) {
    const double step_s = run.recording.step_s;
    const auto settle = static_cast<std::size_t>(kSettle_s / step_s);
    const auto every = static_cast<std::size_t>(kLookEvery_s / step_s);
    for (std::size_t k = settle; k < estimates.size(); ++k) {
      if (estimates[k].contact && !estimates[k - 1].contact) ++alarms;
      if (k % every != 0 || !estimates[k].valid) continue;
      ++looks;
      covered += inside_95(estimates[k].tip_N, estimates[k].covariance_N2) ? 1 : 0;
    }
    time_s += static_cast<double>(estimates.size() - settle) * step_s;
  }
};

/// Contact must be off before the knock: a knock into a false alarm counts as not seen.
double detection_s(const Trials& trials, std::size_t at, const std::vector<EstimateSample>& estimates) {
  const double step_s = trials.knocks.recording.step_s;
  if (estimates[at - 1].contact) return std::numeric_limits<double>::infinity();
  for (std::size_t k = at; k < estimates.size() && trials.knocks.truth[k].contact_N.norm() > 1; ++k) {
    if (estimates[k].contact) return static_cast<double>(k - at) * step_s;
  }
  return std::numeric_limits<double>::infinity();
}

void judge_lifts(OfflineEstimator& estimator, const Trials& trials, Row& metrics) {
  estimator.payload().start();
  (void)estimator.run(trials.empty.run.recording);
  if (!estimator.payload().zero()) throw std::runtime_error("the empty bucket moved too little to be weighed");
  std::vector<double> errors_kg, covered;
  for (const Lift& lift : trials.lifts) {
    estimator.payload().start();
    (void)estimator.run(lift.run.recording);
    const double error_kg = estimator.payload().kg() - lift.mass_kg;
    errors_kg.push_back(error_kg);
    covered.push_back(std::abs(error_kg) <= 1.96 * estimator.payload().sigma_kg() ? 1 : 0);
  }
  metrics["payload_error_kg"] = metric(errors_kg);
  metrics["payload_covered"] = metric(covered);
}

}  // namespace

bool inside_95(const PlanarVector& error_N, const Eigen::Matrix2d& covariance_N2) {
  constexpr double kChi2_95 = 5.991;  // two degrees of freedom
  return error_N.dot(covariance_N2.inverse() * error_N) < kChi2_95;
}

PressScore score_pull(const PlanarVector& truth, const PlanarVector& estimate, bool creeping) {
  const double turn = std::atan2(truth.x() * estimate.y() - truth.y() * estimate.x(), truth.dot(estimate));
  return {.force_N = truth.norm(),
          .error_N = (estimate - truth).norm(),
          .direction_deg = std::abs(turn) * 180 / std::numbers::pi,
          .creeping = creeping};
}

bool PressScore::good() const noexcept {
  return error_N <= std::max(0.03 * force_N, 60.0) && direction_deg <= 3;
}

void add_presses(const std::vector<PressScore>& presses, Row& metrics) {
  for (const bool creeping : {false, true}) {
    std::vector<double> good, errors_N, as_load;
    for (const PressScore& press : presses) {
      if (press.creeping != creeping) continue;
      good.push_back(press.good() ? 1 : 0);
      errors_N.push_back(press.error_N);
      as_load.push_back(press.taken_for_load_N > kLeastTaken * press.force_N ? 1 : 0);
    }
    const std::string which = creeping ? ".creeping" : ".standing";
    metrics["press_good" + which] = metric(good);
    metrics["press_error_N" + which] = metric(errors_N);
    metrics["press_as_load" + which] = metric(as_load);
  }
}

Row score_estimator(const MachineDescription& machine, const Trials& trials) {
  Row metrics;
  OfflineEstimator estimator(machine, trials.warm_up.recording.step_s);
  (void)estimator.run(trials.warm_up.recording);
  const auto slow = estimator.run(trials.slow.recording);
  const auto digging = estimator.run(trials.digging.recording);
  metrics["nis"] = metric(estimator.force().learned().mean_nis());
  const auto pulls = estimator.run(trials.pulls.recording);
  const auto knocks = estimator.run(trials.knocks.recording);
  add_norms("slow", tips(slow), trials.slow.recording.step_s, metrics);
  add_norms("digging", tips(digging), trials.digging.recording.step_s, metrics);
  FreeMotion free;
  free.add(trials.slow, slow);
  free.add(trials.digging, digging);
  metrics["free_covered"] = {free.covered, free.looks};
  metrics["false_alarms"] = {free.alarms, free.time_s};
  const std::vector<PlanarVector> pulled = tips(pulls);
  std::vector<PressScore> presses;
  std::vector<double> covered;
  for (const Press& press : trials.presses) {
    PressScore score = judge_press(trials, press, pulled);
    const std::size_t last = press.judge_to - 1;
    const PlanarVector error_N = pulls[last].tip_N - trials.pulls.truth[last].contact_N;
    covered.push_back(inside_95(error_N, pulls[last].covariance_N2) ? 1 : 0);
    score.taken_for_load_N = (pulls[last].tip_N - pulls[last].contact_N).norm();
    presses.push_back(score);
  }
  add_presses(presses, metrics);
  metrics["press_covered"] = metric(covered);
  metrics["contact_models"] = score_contact_models(machine, trials, pulls);
  std::vector<double> seen_s;
  for (const std::size_t at : trials.knock_at) seen_s.push_back(detection_s(trials, at, knocks));
  metrics["detection_s"] = metric(seen_s);
  judge_lifts(estimator, trials, metrics);
  return metrics;
}

Row score_series(const Trials& trials, const ForceSeries& series) {
  Row metrics;
  add_norms("slow", series.slow, trials.slow.recording.step_s, metrics);
  add_norms("digging", series.digging, trials.digging.recording.step_s, metrics);
  std::vector<PressScore> presses;
  for (const Press& press : trials.presses) presses.push_back(judge_press(trials, press, series.pulls));
  add_presses(presses, metrics);
  return metrics;
}

}  // namespace knuckle::studies
