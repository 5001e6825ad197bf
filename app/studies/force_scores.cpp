#include "app/studies/force_scores.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "app/studies/contact_model_scores.h"
#include "core/quantile.h"

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSettle_s = 1.0;  // filters start at each recording's beginning
constexpr double kLookEvery_s = 0.5;
constexpr double kChi2_95 = 5.991;  // two degrees of freedom

struct Norms {
  double rms_N = kNaN, p95_N = kNaN;
};

Norms norms_of(const std::vector<PlanarVector>& forces, double step_s) {
  std::vector<double> sizes;
  for (auto k = static_cast<std::size_t>(kSettle_s / step_s); k < forces.size(); ++k) {
    if (forces[k].allFinite()) sizes.push_back(forces[k].norm());
  }
  if (sizes.empty()) return {};
  double squares = 0;
  for (const double size : sizes) squares += size * size;
  return {std::sqrt(squares / static_cast<double>(sizes.size())), quantile(sizes, 0.95)};
}

std::vector<PlanarVector> tips(const std::vector<EstimateSample>& samples) {
  std::vector<PlanarVector> result;
  result.reserve(samples.size());
  for (const EstimateSample& sample : samples) {
    result.push_back(sample.valid ? sample.tip_N : PlanarVector::Constant(kNaN));
  }
  return result;
}

bool inside(const PlanarVector& error_N, const Eigen::Matrix2d& covariance_N2) {
  return error_N.dot(covariance_N2.inverse() * error_N) < kChi2_95;
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

void judge_free(const motion::MachineRecording& run, const std::vector<EstimateSample>& estimates,
                ForceScores& scores) {
  const double step_s = run.recording.step_s;
  const auto settle = static_cast<std::size_t>(kSettle_s / step_s);
  const auto every = static_cast<std::size_t>(kLookEvery_s / step_s);
  for (std::size_t k = settle; k < estimates.size(); ++k) {
    if (estimates[k].contact && !estimates[k - 1].contact) ++scores.false_alarms;
    if (k % every != 0 || !estimates[k].valid) continue;
    ++scores.looks;
    scores.covered += inside(estimates[k].tip_N, estimates[k].covariance_N2) ? 1 : 0;
  }
  scores.free_s += static_cast<double>(estimates.size() - settle) * step_s;
}

/// Contact must be off before the knock: a knock into a false alarm counts as not seen.
double detection_s(const Trials& trials, std::size_t at, const std::vector<EstimateSample>& estimates) {
  const double step_s = trials.knocks.recording.step_s;
  if (estimates[at - 1].contact) return std::numeric_limits<double>::infinity();
  for (std::size_t k = at; k < estimates.size() && trials.knocks.truth[k].contact_N.norm() > 1; ++k) {
    if (estimates[k].contact) return static_cast<double>(k - at) * step_s;
  }
  return std::numeric_limits<double>::infinity();
}

void judge_lifts(OfflineEstimator& estimator, const Trials& trials, ForceScores& scores) {
  estimator.payload().start();
  (void)estimator.run(trials.empty.run.recording);
  if (!estimator.payload().zero()) throw std::runtime_error("the empty bucket moved too little to be weighed");
  for (const Lift& lift : trials.lifts) {
    estimator.payload().start();
    (void)estimator.run(lift.run.recording);
    scores.payload_error_kg.push_back(estimator.payload().kg() - lift.mass_kg);
    scores.payload_sigma_kg.push_back(estimator.payload().sigma_kg());
  }
}

void judge_norms(const Trials& trials, const ForceSeries& series, ForceScores& scores) {
  const Norms slow = norms_of(series.slow, trials.slow.recording.step_s);
  const Norms digging = norms_of(series.digging, trials.digging.recording.step_s);
  scores.slow_rms_N = slow.rms_N;
  scores.slow_p95_N = slow.p95_N;
  scores.digging_rms_N = digging.rms_N;
}

}  // namespace

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

ForceScores score_estimator(const MachineDescription& machine, const Trials& trials) {
  ForceScores scores;
  OfflineEstimator estimator(machine, trials.warm_up.recording.step_s);
  (void)estimator.run(trials.warm_up.recording);
  const auto slow = estimator.run(trials.slow.recording);
  const auto digging = estimator.run(trials.digging.recording);
  const double nis = estimator.force().learned().mean_nis();
  const auto pulls = estimator.run(trials.pulls.recording);
  const auto knocks = estimator.run(trials.knocks.recording);
  judge_norms(trials, {tips(slow), tips(digging), {}}, scores);
  judge_free(trials.slow, slow, scores);
  judge_free(trials.digging, digging, scores);
  const std::vector<PlanarVector> pulled = tips(pulls);
  for (const Press& press : trials.presses) {
    PressScore score = judge_press(trials, press, pulled);
    const std::size_t last = press.judge_to - 1;
    score.covered = inside(pulls[last].tip_N - trials.pulls.truth[last].contact_N, pulls[last].covariance_N2);
    score.taken_for_load_N = (pulls[last].tip_N - pulls[last].contact_N).norm();
    scores.presses.push_back(score);
  }
  scores.contact_models = score_contact_models(machine, trials, pulls);
  scores.nis = nis;
  for (const std::size_t at : trials.knock_at) scores.detection_s.push_back(detection_s(trials, at, knocks));
  judge_lifts(estimator, trials, scores);
  return scores;
}

ForceScores score_series(const Trials& trials, const ForceSeries& series) {
  ForceScores scores;
  scores.nis = kNaN;
  judge_norms(trials, series, scores);
  for (const Press& press : trials.presses) scores.presses.push_back(judge_press(trials, press, series.pulls));
  return scores;
}

}  // namespace knuckle::studies
