#include "app/session/metrics.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "app/session/record_windows.h"
#include "estimation/force_estimator.h"
#include "estimation/observer.h"

namespace knuckle::session {
namespace {

constexpr double kSettle_s = 1;  // from the hand's stop, for the position loop to settle (three time constants)
constexpr double kStandstill_s = 1, kStandstill_m = 0.005;  // set-point inside a 5 mm circle for a second
constexpr double kPress_N = 500;                            // contact error is taken above this
constexpr double kReportObserver_Hz = 3;                    // specified lag of the reported force: this pole,
constexpr double kReportVelocity_Hz = 8;                    // and this one twice
constexpr double kDetectable_N = 500, kOnset_N = 50;        // a contact counts for detection if it grows to 500 N
constexpr double kLiftedPayload_kg = 1;
constexpr double kBelieved = 0.5;  // confidence
constexpr double kPumpShort = 0.99;

constexpr MetricEntry kTable[] = {
    {"tip_rms_m", "tracking", "tip_rms_m", "m", &Metrics::tip_rms_m},
    {"tip_max_m", "tracking", "tip_max_m", "m", &Metrics::tip_max_m},
    {"path_rms_m", "tracking", "path_rms_m", "m", &Metrics::path_rms_m},
    {"steady_drift_m", "tracking", "steady_drift_m", "m", &Metrics::steady_drift_m},
    {"no_load_rms_N", "force", "no_load_rms_N", "N", &Metrics::no_load_rms_N},
    {"contact_error_rel", "force", "contact_error_rel", "1", &Metrics::contact_error_rel},
    {"direction_error_deg", "force", "direction_error_deg", "deg", &Metrics::direction_error_deg},
    {"detection_ms", "force", "detection_ms", "ms", &Metrics::detection_ms},
    {"false_contact_share", "force", "false_contact_share", "1", &Metrics::false_contact_share},
    {"free_estimate_peak_N", "force", "free_estimate_peak_N", "N", &Metrics::free_estimate_peak_N},
    {"peak_N", "force", "peak_N", "N", &Metrics::peak_N},
    {"pipe_peak_N", "force", "pipe_peak_N", "N", &Metrics::pipe_peak_N},
    {"payload_truth_kg", "payload", "truth_kg", "kg", &Metrics::payload_truth_kg},
    {"payload_estimate_kg", "payload", "estimate_kg", "kg", &Metrics::payload_estimate_kg},
    {"payload_sigma_kg", "payload", "sigma_kg", "kg", &Metrics::payload_sigma_kg},
    {"payload_error_kg", "payload", "error_kg", "kg", &Metrics::payload_error_kg},
    {"payload_contact_error_kg", "payload", "contact_error_kg", "kg", &Metrics::payload_contact_error_kg},
    {"contact_losses", "felt", "contact_losses", "1", &Metrics::contact_losses},
    {"rise_t90_s", "felt", "rise_t90_s", "s", &Metrics::rise_t90_s},
    {"settle_s", "felt", "settle_s", "s", &Metrics::settle_s},
    {"hold_peak_to_peak_N", "felt", "hold_peak_to_peak_N", "N", &Metrics::hold_peak_to_peak_N},
    {"hold_error_N", "felt", "hold_error_N", "N", &Metrics::hold_error_N},
    {"hold_error_share", "felt", "hold_error_share", "1", &Metrics::hold_error_share},
    {"hold_true_swing_share", "force", "hold_true_swing_share", "1", &Metrics::hold_true_swing_share},
    {"drag_rms_N", "felt", "drag_rms_N", "N", &Metrics::drag_rms_N},
    {"max_slew_N_per_ms", "felt", "max_slew_N_per_ms", "N/ms", &Metrics::max_slew_N_per_ms},
    {"net_energy_J", "felt", "net_energy_J", "J", &Metrics::net_energy_J},
    {"felt_error_rms_N", "felt", "error_rms_N", "N", &Metrics::felt_error_rms_N},
    {"felt_error_rel", "felt", "error_rel", "1", &Metrics::felt_error_rel},
    {"felt_error_worst_N", "felt", "error_worst_N", "N", &Metrics::felt_error_worst_N},
    {"felt_onset_ms", "felt", "onset_ms", "ms", &Metrics::felt_onset_ms},
    {"unfelt_s", "felt", "unfelt_s", "s", &Metrics::unfelt_s},
    {"unfelt_showable_s", "felt", "unfelt_showable_s", "s", &Metrics::unfelt_showable_s},
    {"free_felt_peak_N", "felt", "free_peak_N", "N", &Metrics::free_felt_peak_N},
    {"contact_swing_N", "force", "contact_swing_N", "N", &Metrics::contact_swing_N},
    {"contact_bounces", "force", "contact_bounces", "1", &Metrics::contact_bounces},
    {"fault_rise_N", "force", "fault_rise_N", "N", &Metrics::fault_rise_N},
    {"fault_slew_N_per_ms", "felt", "fault_slew_N_per_ms", "N/ms", &Metrics::fault_slew_N_per_ms},
    {"peak_over_asked", "force", "peak_over_asked", "1", &Metrics::peak_over_asked},
    {"engaged_s", "session", "engaged_s", "s", &Metrics::engaged_s},
    {"faults", "session", "faults", "1", &Metrics::faults},
    {"command_neutral_ms", "session", "command_neutral_ms", "ms", &Metrics::command_neutral_ms},
    {"spool_neutral_ms", "session", "spool_neutral_ms", "ms", &Metrics::spool_neutral_ms},
    {"pieces_broken", "session", "pieces_broken", "1", &Metrics::pieces_broken},
    {"phases_timed_out", "session", "phases_timed_out", "1", &Metrics::phases_timed_out},
    {"resumed_by_itself", "session", "resumed_by_itself", "1", &Metrics::resumed_by_itself},
    {"records_lost", "session", "records_lost", "1", &Metrics::records_lost},
    {"home_opening", "session", "home_opening", "1", &Metrics::home_opening},
    {"home_speed", "session", "home_speed", "1", &Metrics::home_speed},
    {"pump_short_share", "session", "pump_short_share", "1", &Metrics::pump_short_share},
};

/// Where the hand asked the tip to be at a past time, between rows; null before the first engaged row.
class PastSetpoint {
 public:
  explicit PastSetpoint(const SessionRecord& record) : rows_(record.samples) {}
  /// Times must not go back from call to call.
  std::optional<PlanarVector> at(double t_s) {
    while (row_ + 1 < rows_.size() && rows_[row_ + 1].t_s <= t_s) ++row_;
    const Sample& a = rows_[row_];
    if (t_s < a.t_s || a.machine.mode != Mode::kEngaged) return std::nullopt;
    if (row_ + 1 == rows_.size()) return a.hand_setpoint_tip_m;
    const Sample& b = rows_[row_ + 1];
    const double share = (t_s - a.t_s) / (b.t_s - a.t_s);
    return PlanarVector(a.hand_setpoint_tip_m + share * (b.hand_setpoint_tip_m - a.hand_setpoint_tip_m));
  }

 private:
  const std::vector<Sample>& rows_;
  std::size_t row_ = 0;
};

/// Mean tip error over each second in which the delayed set-point stood still.
class Standstill {
 public:
  void add(double t_s, const PlanarVector& setpoint_m, const PlanarVector& error_m, Metric& worst_m) {
    if (start_s_ < 0 || (setpoint_m - anchor_m_).norm() > kStandstill_m || t_s - last_s_ > kStandstill_s / 10) {
      restart(t_s, setpoint_m);
    }
    last_s_ = t_s;
    if (t_s - start_s_ < kSettle_s) return;
    sum_m_ += error_m;
    ++count_;
    if (t_s - start_s_ < kSettle_s + kStandstill_s) return;
    keep_worst(worst_m, (sum_m_ / count_).norm(), t_s);
    restart(t_s, setpoint_m);
  }

 private:
  void restart(double t_s, const PlanarVector& setpoint_m) {
    start_s_ = t_s;
    anchor_m_ = setpoint_m;
    sum_m_.setZero();
    count_ = 0;
  }
  double start_s_ = -1, last_s_ = 0;
  PlanarVector anchor_m_ = PlanarVector::Zero(), sum_m_ = PlanarVector::Zero();
  int count_ = 0;
};

void measure_tracking(const SessionRecord& record, const std::vector<bool>& free, Metrics& metrics) {
  if (record.samples.empty()) return;
  PastSetpoint hand(record);
  Mean squares, path_squares;
  Standstill standstill;
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const Sample& s = record.samples[i];
    const auto wanted_m = hand.at(s.t_s - record.link_delay_s);
    if (!free[i] || !wanted_m) continue;
    const PlanarVector error_m = s.truth.tip_m - *wanted_m;
    squares.add(error_m.squaredNorm(), s.t_s);
    if (phase_name(record, s) == "path") path_squares.add(error_m.squaredNorm(), s.t_s);
    keep_worst(metrics.tip_max_m, error_m.norm(), s.t_s);
    standstill.add(s.t_s, *wanted_m, s.tip_m - *wanted_m, metrics.steady_drift_m);
  }
  metrics.tip_rms_m = squares.root();
  metrics.path_rms_m = path_squares.root();
}

void measure_no_load(const SessionRecord& record, const std::vector<bool>& free, Metrics& metrics) {
  Mean squares;
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const Sample& s = record.samples[i];
    const bool bias_learned = (s.machine.confidence_reasons & estimation::kBiasNotLearned) == 0;
    if (!free[i] || !bias_learned || s.truth.payload_kg != 0) continue;
    squares.add(s.machine.tip_force_N.squaredNorm(), s.t_s);
    if (s.machine.confidence > kBelieved) keep_worst(metrics.free_estimate_peak_N, s.machine.tip_force_N.norm(), s.t_s);
  }
  metrics.no_load_rms_N = squares.root();
}

/// The true tip force as late as the reported one is built to be; how late that may be is judged by what notices and
/// feels it (detection, rise). Poles stated anew: an estimator that gets slower must show.
class LateForce {
 public:
  explicit LateForce(double row_s) noexcept
      : first_(kReportVelocity_Hz, row_s), second_(kReportVelocity_Hz, row_s), observer_(kReportObserver_Hz, row_s) {}
  const PlanarVector& step(const PlanarVector& force_N) noexcept {
    return observer_.step(second_.step(first_.step(force_N)));
  }

 private:
  estimation::FohFilter<PlanarVector> first_, second_, observer_;
};

double angle_between_deg(const PlanarVector& a, const PlanarVector& b) {
  return std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b))) * 180 / std::numbers::pi;
}

void measure_peaks(const SessionRecord& record, Metrics& metrics) {
  for (const Sample& s : record.samples) {
    keep_worst(metrics.peak_N, s.truth.tip_force_N.norm(), s.t_s);
    if (s.truth.pipe_N > 0) keep_worst(metrics.pipe_peak_N, s.truth.pipe_N, s.t_s);
  }
}

/// Magnitude and direction against the late truth wherever that presses: a hand need not hold still to be judged.
void measure_contact_force(const SessionRecord& record, Metrics& metrics) {
  const auto& rows = record.samples;
  if (rows.size() < 2) return;
  LateForce late((rows.back().t_s - rows.front().t_s) / static_cast<double>(rows.size() - 1));
  Mean error, angle_deg;
  for (const Sample& s : rows) {
    const PlanarVector truth_N = late.step(s.truth.tip_force_N);
    if (s.machine.mode != Mode::kEngaged || truth_N.norm() <= kPress_N) continue;
    error.add(std::abs(s.machine.tip_force_N.norm() / truth_N.norm() - 1), s.t_s);
    angle_deg.add(angle_between_deg(s.machine.tip_force_N, truth_N), s.t_s);
  }
  metrics.contact_error_rel = error.value();
  metrics.direction_error_deg = angle_deg.value();
}

/// Slowest contact event: from the true force's passing 50 N to the event, for contacts that come out of free motion
/// and grow to 500 N. A contact that is never noticed counts with its whole length.
void measure_detection(const SessionRecord& record, const std::vector<bool>& free, Metrics& metrics) {
  const auto& rows = record.samples;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (!free[i - 1] || rows[i - 1].machine.contact || !in_contact(rows[i])) continue;
    std::optional<double> onset_s, noticed_s;
    double peak_N = 0;
    for (; i < rows.size() && in_contact(rows[i]); ++i) {
      const double force_N = rows[i].truth.tip_force_N.norm();
      peak_N = std::max(peak_N, force_N);
      if (!onset_s && force_N > kOnset_N) onset_s = rows[i].t_s;
      if (!noticed_s && rows[i].machine.contact) noticed_s = rows[i].t_s;
    }
    if (peak_N < kDetectable_N) continue;
    const double ms = 1e3 * (noticed_s.value_or(rows[i - 1].t_s) - *onset_s);
    keep_worst(metrics.detection_ms, std::max(0.0, ms), *onset_s);
  }
}

void measure_false_contact(const SessionRecord& record, const std::vector<bool>& free, Metrics& metrics) {
  Mean alarms;
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    if (free[i]) alarms.add(record.samples[i].machine.contact ? 1 : 0, record.samples[i].t_s);
  }
  metrics.false_contact_share = alarms.value();
}

/// At the end of the last phase "weigh"; without one, where the estimate was surest of a lifted load.
void measure_payload(const SessionRecord& record, Metrics& metrics) {
  const Sample* weighed = nullptr;
  const Sample* surest = nullptr;
  for (const Sample& s : record.samples) {
    if (phase_name(record, s) == "weigh") weighed = &s;
    if (s.truth.payload_kg >= kLiftedPayload_kg && s.truth.tip_force_N.norm() > kOnset_N)
      keep_worst(metrics.payload_contact_error_kg, std::abs(s.machine.payload_kg - s.truth.payload_kg), s.t_s);
    if (s.truth.payload_kg < kLiftedPayload_kg || s.machine.payload_sigma_kg <= 0) continue;
    if (surest == nullptr || s.machine.payload_sigma_kg < surest->machine.payload_sigma_kg) surest = &s;
  }
  const Sample* s = weighed != nullptr ? weighed : surest;
  if (s == nullptr) return;
  metrics.payload_truth_kg = s->truth.payload_kg;
  metrics.payload_estimate_kg = s->machine.payload_kg;
  metrics.payload_sigma_kg = s->machine.payload_sigma_kg;
  keep_worst(metrics.payload_error_kg, std::abs(s->machine.payload_kg - s->truth.payload_kg), s->t_s);
}

void measure_session(const SessionRecord& record, Metrics& metrics) {
  metrics.phases_timed_out = record.phases_timed_out;
  if (!record.plan_finished && !record.samples.empty()) metrics.phases_timed_out.at_s = record.samples.back().t_s;
  metrics.resumed_by_itself = record.resumed_by_itself;
  metrics.records_lost = static_cast<double>(record.records_lost);
  metrics.faults = static_cast<double>(record.faults.size());
  // Of what is not neutral when the session is cut short it is known how long it was not.
  const double never_s =
      record.cut_short && !record.samples.empty() ? record.samples.back().t_s : std::numeric_limits<double>::infinity();
  for (const FaultRecord& fault : record.faults) {
    metrics.faults.at_s = fault.at_s;
    const auto worst = [&](Metric& metric, double neutral_s) {
      const double ms = 1e3 * ((neutral_s > 0 ? neutral_s : never_s) - fault.last_good_input_s);
      keep_worst(metric, std::max(0.0, ms), fault.at_s);
    };
    if (!fault.controller_silent) worst(metrics.command_neutral_ms, fault.command_neutral_s);
    worst(metrics.spool_neutral_ms, fault.spool_neutral_s);
  }
  metrics.pieces_broken = 0;
  for (const EventRecord& event : record.events) {
    if (is_break(event)) count_one(metrics.pieces_broken, event.t_s);
  }
  double engaged_s = 0, short_s = 0;
  for (std::size_t i = 1; i < record.samples.size(); ++i) {
    const Sample& s = record.samples[i];
    if (s.machine.mode != Mode::kEngaged) continue;
    if (s.machine.home_on_two) {
      keep_worst(metrics.home_opening, s.machine.valve_command.cwiseAbs().maxCoeff(), s.t_s);
      keep_worst(metrics.home_speed, s.truth.joint_radps.cwiseQuotient(record.most_radps).cwiseAbs().maxCoeff(), s.t_s);
    }
    const double step_s = s.t_s - record.samples[i - 1].t_s;
    engaged_s += step_s;
    if (s.truth.pump_flow_share < kPumpShort) short_s += step_s;
  }
  metrics.engaged_s = engaged_s;
  if (engaged_s > 0) metrics.pump_short_share = short_s / engaged_s;
}

}  // namespace

std::span<const MetricEntry> metric_table() noexcept {
  return kTable;
}

const MetricEntry* find_metric(std::string_view name) noexcept {
  for (const MetricEntry& entry : kTable)
    if (entry.name == name) return &entry;
  return nullptr;
}

Metrics compute_metrics(const SessionRecord& record) {
  Metrics metrics;
  const std::vector<bool> free = free_motion(record);
  measure_tracking(record, free, metrics);
  measure_no_load(record, free, metrics);
  measure_peaks(record, metrics);
  measure_contact_force(record, metrics);
  measure_detection(record, free, metrics);
  measure_false_contact(record, free, metrics);
  measure_payload(record, metrics);
  measure_felt(record, metrics);
  measure_truth(record, metrics);
  measure_session(record, metrics);
  return metrics;
}

std::vector<ModeVisit> modes_visited(const SessionRecord& record) {
  std::vector<ModeVisit> visits;
  for (const Sample& s : record.samples) {
    if (visits.empty() || visits.back().mode != s.machine.mode) visits.push_back({s.machine.mode, s.t_s, 0});
    visits.back().duration_s = s.t_s - visits.back().at_s;
  }
  return visits;
}

PortEnergies port_energies(const SessionRecord& record) noexcept {
  PortEnergies energies;
  const auto split = [](double change_J, double& in_J, double& out_J) {
    (change_J > 0 ? in_J : out_J) += std::abs(change_J);
  };
  for (std::size_t i = 1; i < record.samples.size(); ++i) {
    const Sample &a = record.samples[i - 1], &b = record.samples[i];
    split(b.hand.energy_J - a.hand.energy_J, energies.hand_in_J, energies.hand_out_J);
    split(b.truth.energy_to_machine_J - a.truth.energy_to_machine_J, energies.machine_in_J, energies.machine_out_J);
  }
  return energies;
}

std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics,
                                      const SessionRecord& record) {
  std::vector<CriterionResult> results;
  for (const Criterion& c : criteria) {
    const MetricEntry& entry = *find_metric(c.metric);
    const Metric& value = metrics.*entry.member;
    CriterionResult result{
        c.metric, static_cast<const std::optional<double>&>(value), std::string(entry.unit), "", 0, c.kind, {}, {}, ""};
    const auto add = [&](const char* relation, double bound, bool met, bool exceeded) {
      result.relation = relation;
      result.bound = bound;
      result.met = met;
      // What is too small has no moment: that of the largest value says nothing of it.
      if (value && *value != 0 && value.at_s && result.relation == "max") {
        result.at_s = value.at_s;
        result.phase = phase_at(record, *value.at_s);
      }
      if (record.cut_short && !(exceeded && c.kind == CriterionKind::kSafety)) result.met.reset();
      results.push_back(result);
    };
    // Written so that a NaN fails.
    const bool reaches = value && *value >= c.min.value_or(0), keeps = value && *value <= c.max.value_or(0);
    if (c.min) add("min", *c.min, reaches, false);
    if (c.max) add("max", *c.max, keeps, value.has_value() && !keeps);
  }
  return results;
}

bool decides(CriterionKind kind, bool requirements_decide) noexcept {
  return kind == CriterionKind::kRequirement ? requirements_decide : kind != CriterionKind::kGoal;
}

bool all_passed(const std::vector<CriterionResult>& results, bool requirements_decide) noexcept {
  return std::none_of(results.begin(), results.end(), [requirements_decide](const CriterionResult& r) {
    return r.missed() && decides(r.kind, requirements_decide);
  });
}

}  // namespace knuckle::session
