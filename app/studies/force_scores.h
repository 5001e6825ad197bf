// How good a method's forces are on one machine's trials.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "app/studies/offline_estimator.h"
#include "app/studies/trials.h"

namespace knuckle::studies {

struct PressScore {
  double force_N = 0, error_N = 0, direction_deg = 0;
  bool creeping = false;
  bool covered = false;         ///< Truth inside the 95 % ellipse.
  double taken_for_load_N = 0;  ///< Part of the estimate that was reported as a load's weight, at the end.
  /// Within max(3 %, 60 N) and 3 degrees.
  [[nodiscard]] bool good() const noexcept;
};

/// Estimate of one pull against its truth; NaN where there is none.
[[nodiscard]] PressScore score_pull(const PlanarVector& truth, const PlanarVector& estimate, bool creeping);

/// Of one model: a pull that it refuses has no answer (NaN) and counts as missed.
struct ContactModelScore {
  std::string model;
  std::vector<PressScore> presses;
  std::vector<double> torque_Nm;      ///< tip_wrench: torque about the tip, where there is none.
  std::vector<double> place_error_m;  ///< force_and_position: along the bucket; its direction is given.
};

/// NaN and empty where a method has no answer of that kind.
struct ForceScores {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double slow_rms_N = kNone, slow_p95_N = kNone;  ///< |F| in free motion.
  double digging_rms_N = kNone;                   ///< Likewise at digging speed.
  std::vector<PressScore> presses;
  std::vector<ContactModelScore> contact_models;  ///< The others, on the same pulls.
  std::vector<double> detection_s;  ///< Of each 500 N step; infinite where it was not seen while it lasted.
  int false_alarms = 0;
  double free_s = 0;           ///< Of free motion that they were counted over.
  int looks = 0, covered = 0;  ///< Free motion every half second: zero inside the 95 % ellipse.
  std::vector<double> payload_error_kg, payload_sigma_kg;
  double nis = 0;  ///< Mean normalised innovation squared of the tare's filter, per degree of freedom.
};

/// The real-time estimator, first adapting in the warm-up. Forces are judged with what it takes for a load's weight.
[[nodiscard]] ForceScores score_estimator(const MachineDescription& machine, const Trials& trials);

/// Of a method that only gives a tip force: one series per recording, NaN where it has none.
struct ForceSeries {
  std::vector<PlanarVector> slow, digging, pulls;
};
[[nodiscard]] ForceScores score_series(const Trials& trials, const ForceSeries& series);

}  // namespace knuckle::studies
