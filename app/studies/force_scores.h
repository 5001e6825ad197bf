// How good a method's forces are on one machine's trials.
#pragma once

#include <vector>

#include "app/battery/quantity.h"
#include "app/studies/trials.h"

namespace knuckle::studies {

using battery::add_joints;
using battery::metric;
using battery::Row;

struct PressScore {
  double force_N = 0, error_N = 0, direction_deg = 0;
  bool creeping = false;
  double taken_for_load_N = 0;  ///< Part of the estimate that was reported as a load's weight, at the end.
  /// Within max(3 %, 60 N) and 3 degrees.
  [[nodiscard]] bool good() const noexcept;
};

/// Estimate of one pull against its truth; NaN where there is none.
[[nodiscard]] PressScore score_pull(const PlanarVector& truth, const PlanarVector& estimate, bool creeping);

/// Within the ellipse that holds 95 %.
[[nodiscard]] bool inside_95(const PlanarVector& error_N, const Eigen::Matrix2d& covariance_N2);

/// Metrics of pulls, for standing ones and, likewise, .creeping: press_good.standing and press_as_load.standing (a
/// tenth or more was reported as a load), 0 or 1 each; press_error_N.standing. A pull without an answer is one missed.
void add_presses(const std::vector<PressScore>& presses, Row& metrics);

/// The real-time estimator, first adapting in the warm-up. Forces are judged with what it takes for a load's weight.
/// Metrics: |F| in free motion (slow_rms_N, slow_p95_N, digging_rms_N); add_presses() and press_covered (truth inside
/// the 95 % ellipse, 0 or 1); free_covered (looks every half second of free motion that have zero inside the ellipse,
/// of how many); nis (mean normalised innovation squared of the bias filter, per degree of freedom); detection_s of
/// each 500 N step, null where it was not seen while it lasted; false_alarms and in how many seconds; payload_error_kg,
/// and payload_covered by its 95 % interval. contact_models: the same pulls by other models (contact_model_scores.h).
[[nodiscard]] Row score_estimator(const MachineDescription& machine, const Trials& trials);

/// Of a method that only gives a tip force: one series per recording, NaN where it has none.
struct ForceSeries {
  std::vector<PlanarVector> slow, digging, pulls;
};
/// Metrics: the first three and add_presses().
[[nodiscard]] Row score_series(const Trials& trials, const ForceSeries& series);

}  // namespace knuckle::studies
