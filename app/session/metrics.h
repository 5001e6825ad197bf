// The numbers a session is judged by, computed from its record alone, and what a scenario asks of them: bounds, what it
// means to miss one, and the verdict. docs/scenarios.md says how each is defined.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/session_record.h"

namespace knuckle::session {

/// A number; null where the session had nothing to measure it on (no press, no payload, ...).
struct Metric : std::optional<double> {
  using std::optional<double>::optional;
  /// When it was at its worst; of a mean, when most went into it. Null where there is no such moment.
  std::optional<double> at_s{};
};

/// Keeps the larger value, and when it was; one that is no number is the worst of all.
inline void keep_worst(Metric& worst, double value, double at_s) {
  if (worst && (std::isnan(*worst) || value <= *worst)) return;
  worst = value;
  worst.at_s = at_s;
}
/// Of what is counted, the last one's moment stays.
inline void count_one(Metric& count, double at_s) {
  count = count.value_or(0) + 1;
  count.at_s = at_s;
}

/// Of values added one after the other; null while there is none.
class Mean {
 public:
  void add(double value, double at_s) {
    sum_ += value;
    ++count_;
    keep_worst(largest_, value, at_s);
  }
  [[nodiscard]] Metric value() const {
    Metric mean;
    if (count_ > 0) mean = sum_ / count_;
    mean.at_s = largest_.at_s;
    return mean;
  }
  /// Of values that were added as their squares.
  [[nodiscard]] Metric root() const {
    Metric root = value();
    if (root) *root = std::sqrt(*root);
    return root;
  }

 private:
  double sum_ = 0;
  int count_ = 0;
  Metric largest_;
};

struct Metrics {
  // tracking: free motion only, tip against hand(t - one-way link delay)
  Metric tip_rms_m, tip_max_m;
  Metric path_rms_m;      ///< The same while a recording is followed (phases named "path").
  Metric steady_drift_m;  ///< Largest mean error over a second in which the hand stood still.
  // force: estimate against truth
  Metric no_load_rms_N, contact_error_rel, direction_error_deg, detection_ms, peak_N, pipe_peak_N;
  Metric false_contact_share;   ///< Of free motion, with the contact event on.
  Metric free_estimate_peak_N;  ///< Largest in free motion without a load, where confidence is above one half.
  // payload
  Metric payload_truth_kg, payload_estimate_kg, payload_sigma_kg, payload_error_kg;
  Metric payload_contact_error_kg;  ///< Largest error of the load while the loaded bucket touches something.
  // felt
  Metric contact_losses, rise_t90_s, settle_s, hold_peak_to_peak_N, hold_error_N, drag_rms_N, max_slew_N_per_ms,
      net_energy_J;
  Metric hold_error_share;       ///< Hold error over what is allowed of it: a tenth of the force, 0.3 N at least.
  Metric hold_true_swing_share;  ///< Swing of the true force over what is allowed of it: a tenth, 150 N at least.
  // felt, against the truth of the whole session
  Metric felt_error_rms_N, felt_error_rel, felt_error_worst_N, felt_onset_ms, unfelt_s, free_felt_peak_N;
  Metric unfelt_showable_s;  ///< Of unfelt_s, that in which the device could have shown the force.
  Metric contact_swing_N, contact_bounces;
  Metric fault_rise_N,
      fault_slew_N_per_ms;  ///< After something was broken: rise of the true force, change of the felt.
  Metric peak_over_asked;   ///< Largest true force over what presses asked for and their impact.
  // session
  Metric engaged_s;                             ///< Time in mode engaged.
  Metric faults;                                ///< Number of faults latched.
  Metric command_neutral_ms, spool_neutral_ms;  ///< Worst fault: last good input to neutral.
  Metric pieces_broken;                         ///< World events that say "broke".
  Metric phases_timed_out;                      ///< 1 where the operator's plan did not come to its end.
  Metric resumed_by_itself;  ///< Faults after which a valve was commanded before enable was pressed anew.
  Metric records_lost;       ///< Rows, frames, events and faults the recorder had no room for: fails every session.
  Metric home_opening, home_speed;  ///< Going home on two: widest valve command, fastest true joint by its limit.
  Metric pump_short_share;          ///< Of engaged time, pump delivering under 99 % of what was asked.
};

/// How a metric is called in scenario criteria and in the JSON result: group.key.
struct MetricEntry {
  std::string_view name;   ///< Unique; used by criteria.
  std::string_view group;  ///< JSON object: tracking, force, payload, felt, session
  std::string_view key;    ///< Key in that object.
  std::string_view unit;
  Metric Metrics::*member;
};
[[nodiscard]] std::span<const MetricEntry> metric_table() noexcept;
/// @return nullptr for an unknown name.
[[nodiscard]] const MetricEntry* find_metric(std::string_view name) noexcept;

[[nodiscard]] Metrics compute_metrics(const SessionRecord& record);
// Parts of it.
/// Fills what the operator's hand would name: contact kept, rise, settling, hold, drag, slew.
void measure_felt(const SessionRecord& record, Metrics& metrics);
/// Fills what compares, over the whole session, what is felt with what is true while engaged.
void measure_truth(const SessionRecord& record, Metrics& metrics);

/// A stay in one mode.
struct ModeVisit {
  Mode mode;
  double at_s, duration_s;
};
[[nodiscard]] std::vector<ModeVisit> modes_visited(const SessionRecord& record);

/// Work over the two ports; in = into the hand or machine, out = back from it, net = in - out.
struct PortEnergies {
  double hand_in_J = 0, hand_out_J = 0;
  double machine_in_J = 0, machine_out_J = 0;
};
[[nodiscard]] PortEnergies port_energies(const SessionRecord& record) noexcept;

// What a scenario asks.

enum class CriterionKind : std::uint8_t {
  kSafety,       ///< Must never happen: decides with every machine and seed.
  kCriterion,    ///< Of a user's own scenario: likewise.
  kRequirement,  ///< Must not get worse: decides for the stock set-up, and where it is asked to.
  kGoal          ///< Is worked towards: decides nothing.
};

/// One entry of a scenario. At least one bound is set.
struct Criterion {
  std::string metric;  ///< Name of a metric, as in metric_table().
  std::optional<double> min, max;
  CriterionKind kind = CriterionKind::kCriterion;
};

/// One bound checked. A metric the session could not measure fails its criterion.
struct CriterionResult {
  std::string name;
  std::optional<double> value;
  std::string unit;
  std::string relation;  ///< "max" or "min"
  double bound = 0;
  CriterionKind kind = CriterionKind::kCriterion;
  std::optional<bool> met;     ///< Null: the session was cut short before it could be judged.
  std::optional<double> at_s;  ///< When it was at its worst; null where there is no such moment, or it is 0.
  std::string phase;           ///< Of the operator, then.

  [[nodiscard]] bool missed() const noexcept { return met == false; }
};

/// Metrics that [[safety]] may name.
inline constexpr std::string_view kSafetyMetrics[] = {"command_neutral_ms", "spool_neutral_ms", "max_slew_N_per_ms",
                                                      "resumed_by_itself", "faults"};

/// One result per bound, in the order given.
/// @param criteria of metrics that find_metric knows.
/// @param record that the metrics were taken from. Where it was cut short, only a [[safety]] maximum that is exceeded
/// already is judged.
[[nodiscard]] std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics,
                                                    const SessionRecord& record = {});

/// Whether one that is missed fails the session.
[[nodiscard]] bool decides(CriterionKind kind, bool requirements_decide) noexcept;
/// Whether none of those that decide is missed.
[[nodiscard]] bool all_passed(const std::vector<CriterionResult>& results, bool requirements_decide = true) noexcept;

}  // namespace knuckle::session
