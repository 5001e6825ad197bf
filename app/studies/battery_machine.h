// One sampled machine of the estimation battery: commissioned, identified by every method, judged on held-out trials.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/battery/rows.h"
#include "app/identify/commission.h"
#include "app/studies/running_pulls.h"
#include "app/studies/trials.h"
#include "estimation/identification/identification.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::studies {

using battery::Row;

// Methods, as the table names them.
inline constexpr const char* kFull = "full";
inline constexpr const char* kFullNominalPins = "full, nominal pins";       ///< No survey.
inline constexpr const char* kFullFineEncoders = "full, 0.03 mm encoders";  ///< Contact only.
inline constexpr const char* kUncalibrated = "not calibrated";              ///< The estimator without any file.

/// A method "full" with something changed, for the ablation.
struct FullVariant {
  std::string method;
  estimation::FullOptions options;
};

struct BatterySetup {
  MachineDescription nominal;
  identify::CommissionPlan commission;
  TrialPlan trials;
  estimation::FullOptions full;               ///< With the model-error covariance, where there is one.
  estimation::FullOptions full_nominal_pins;  ///< Likewise, of machines that were not surveyed.
  std::vector<FullVariant> variants;          ///< Identified from the same recordings, judged on the same trials.
  sim::Family family = sim::Family::kSmooth;  ///< That the machines are of.
  bool oil_changes = true;                    ///< Other oil on the day of use.
  std::optional<PullPlan> running;            ///< Judged while it runs, with each contact model, instead of all else.
  bool baselines = true;                      ///< The papers' methods, no calibration, nominal pins, fine encoders.
};

/// Its part of a battery's row: {"seed", "failure": why nothing could be judged}, or {"seed", "commissioning": metrics
/// (commission_scores.h), "methods": [...]}. Of a method: {"method", "identified": the data were enough for a result,
/// which the trials then judge, "usable": by the rule of held_out.h, as `knuckle identify` would say, "reason": why
/// not, "metrics"}: those of force_scores.h, or of running_pulls.h under a contact model's name; where there is a
/// model, of held-out motion of the same day torque_2Hz.JOINT and torque_raw.JOINT (NRMSE); where there are parameters,
/// gravity.JOINT, inertia.JOINT, friction.JOINT (parameter_scores.h) and parameters_covered (intervals that hold the
/// truth, of how many).
/// @throws Interrupted once a signal has come.
[[nodiscard]] Row judge_machine(const BatterySetup& setup, const sim::MachineTruth& truth, std::uint64_t seed);
/// Whether this is such a part of a row.
[[nodiscard]] bool is_judged_machine(const Row& row);

}  // namespace knuckle::studies
