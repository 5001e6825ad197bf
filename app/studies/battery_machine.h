// One sampled machine of the estimation battery: commissioned, identified by every method, judged on held-out trials.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/identify/commission.h"
#include "app/identify/parameter_scores.h"
#include "app/studies/commission_scores.h"
#include "app/studies/force_scores.h"
#include "app/studies/trials.h"
#include "estimation/identification/identification.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::studies {

// Methods, as the table names them.
inline constexpr const char* kFull = "full";
inline constexpr const char* kFullNominalPins = "full, nominal pins";       ///< No survey.
inline constexpr const char* kFullFineEncoders = "full, 0.03 mm encoders";  ///< Contact only.
inline constexpr const char* kUncalibrated = "not calibrated";              ///< The estimator without any file.

struct MethodOutcome {
  std::string method;
  bool identified = false;  ///< The data were enough for a result, which the trials then judge.
  bool usable = false;      ///< By the rule of held_out.h, as `knuckle identify` would say.
  std::string reason;       ///< Why not.
  ForceScores force;
  estimation::TorqueFit torque_2Hz, torque_raw;  ///< On held-out motion of the same day; NaN where there is no model.
  std::optional<identify::ParameterScores> parameters;
};

struct MachineOutcome {
  std::uint64_t seed = 0;
  std::string failure;  ///< Not empty: nothing could be judged.
  CommissionScores commissioning;
  std::vector<MethodOutcome> methods;
};

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
  bool baselines = true;                      ///< The papers' methods, no calibration, nominal pins, fine encoders.
};

/// Never throws for a machine that fails: it says so in the outcome. @throws Interrupted once a signal has come.
[[nodiscard]] MachineOutcome judge_machine(const BatterySetup& setup, const sim::MachineTruth& truth,
                                           std::uint64_t seed);

}  // namespace knuckle::studies
