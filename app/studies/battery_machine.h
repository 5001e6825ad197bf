// One sampled machine of the estimation battery: commissioned, identified by every method, judged on held-out trials.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/battery/rows.h"
#include "app/identify/commission.h"
#include "app/studies/trials.h"
#include "estimation/identification/identification.h"
#include "machine/contact_model.h"
#include "machine/description.h"
#include "machine/description_fwd.h"
#include "sim/truth.h"

namespace knuckle::studies {

// Known pulls on a machine whose side runs: what the slave loop itself reports of them, through bus, estimator and
// contact model, while it holds the machine still or lets it creep. trials.h judges the same estimator on recordings.
struct PullPlan {
  double free_s = 30;              ///< Of free motion, slow and at digging speed each.
  int poses = 5, directions = 12;  ///< Of pulls at the tip; each standing and creeping.
  int push_poses = 5;              ///< Of pushes on the sides of the bucket's outline, likewise.
};

/// Drives the machine with this contact model and judges what the slave loop reports, the load included. With
/// force_and_position the file's direction is one of six, by the seed; it is pulled both ways along it, and not pushed.
/// Metrics: answered (0 or 1: a pull may be refused) and add_presses() of pulls at the tip; press_covered of them.
/// Torque about the tip, of which free motion has none and pulls at the tip neither: free_torque_Nm,
/// tip_torque_error_Nm, and its 95 % interval: free_torque_covered [looks, of], tip_torque_covered. Offset of the line
/// of action there: tip_offset_m, tip_offset_covered. Pushes beside the tip: beside_error_N, beside_covered,
/// beside_torque_error_Nm, beside_torque_good (within 40 N m or 15 %), beside_torque_covered, beside_offset_m,
/// beside_offset_covered; side_right (the side pushed on has more than half of the probability), and side_right.NAME of
/// each, of those at 30 degrees or more to the side. free_covered and false_alarms as score_estimator() has them.
/// @param machine as the controller sees it. @throws NotLed; Interrupted once a signal has come.
[[nodiscard]] battery::Row score_running(MachineDescription machine, const sim::MachineTruth& truth, ContactModel model,
                                         const PullPlan& plan, std::uint64_t seed);

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
/// not, "metrics"}: those of force_scores.h, or of running_pulls.cpp under a contact model's name; where there is a
/// model, of held-out motion of the same day torque_2Hz.JOINT and torque_raw.JOINT (NRMSE); where there are parameters,
/// gravity.JOINT, inertia.JOINT, friction.JOINT (parameter_scores.h) and parameters_covered (intervals that hold the
/// truth, of how many).
/// @throws Interrupted once a signal has come.
[[nodiscard]] Row judge_machine(const BatterySetup& setup, const sim::MachineTruth& truth, std::uint64_t seed);
/// Whether this is such a part of a row.
[[nodiscard]] bool is_judged_machine(const Row& row);

// From many machines' metrics to the rows of one table: quantity, method, value, unit, target, met.

struct BatteryRow {
  std::string quantity, method;
  double value = 0;  ///< NaN where no machine had one.
  std::string unit;
  std::string target;       ///< "<= 30", ">= 0.97", "0.9 to 0.99"; empty: stated only.
  std::optional<bool> met;  ///< Null without a target. Targets are for the method "full" alone.
};

/// Rows in a fixed order; the methods in the order of the first machine that has them.
/// @param machines as judge_machine() gives them.
[[nodiscard]] std::vector<BatteryRow> battery_rows(const std::vector<Row>& machines, double full_scale_kg);

}  // namespace knuckle::studies
