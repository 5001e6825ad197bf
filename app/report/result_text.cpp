#include "app/report/result_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "app/session/record_windows.h"
#include "machine/reason_text.h"

namespace knuckle::report {

std::string number_text(double value, int significant) {
  constexpr double kSmallest = 1e-6;
  if (!std::isfinite(value)) return "-";
  if (value == 0) return "0";
  if (std::abs(value) < kSmallest) return value > 0 ? "< 0.000001" : "> -0.000001";
  const int decimals = significant - 1 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  if (decimals <= 0) return fmt::format("{:.0f}", value);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  text.resize(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

namespace {

using MetricName = std::pair<std::string_view, std::string_view>;

constexpr std::array kMetrics{
    MetricName{"tip_rms_m", "error of the tip in free motion, RMS"},
    MetricName{"tip_max_m", "error of the tip in free motion, largest"},
    MetricName{"path_rms_m", "error of the tip along the recorded path, RMS"},
    MetricName{"steady_drift_m", "error of the tip at rest, largest mean over a second"},
    MetricName{"no_load_rms_N", "estimated force where there is none, RMS"},
    MetricName{"contact_error_rel", "error of the estimated force in contact, as a share of the true one"},
    MetricName{"direction_error_deg", "error of the estimated force's direction"},
    MetricName{"detection_ms", "delay until a contact is detected, slowest"},
    MetricName{"false_contact_share", "share of free motion in which a contact is reported"},
    MetricName{"free_estimate_peak_N", "largest estimated force in free motion"},
    MetricName{"peak_N", "largest true force on the tip"},
    MetricName{"pipe_peak_N", "largest true force on a buried pipe"},
    MetricName{"payload_truth_kg", "true load"},
    MetricName{"payload_estimate_kg", "estimated load"},
    MetricName{"payload_sigma_kg", "standard deviation of the estimated load"},
    MetricName{"payload_error_kg", "error of the estimated load"},
    MetricName{"payload_contact_error_kg", "error of the estimated load while the bucket touches something, largest"},
    MetricName{"contact_losses", "times that contact was lost during a press"},
    MetricName{"rise_t90_s", "time until a press is felt to 90 %, slowest"},
    MetricName{"settle_s", "time until the felt force of a press has settled, slowest"},
    MetricName{"hold_peak_to_peak_N", "swing of the felt force during a hold, worst"},
    MetricName{"hold_error_N", "error of the felt force during a hold, worst"},
    MetricName{"hold_error_share", "error of the felt force during a hold, as a share of what is allowed"},
    MetricName{"hold_true_swing_share", "swing of the true force during a hold, as a share of what is allowed"},
    MetricName{"drag_rms_N", "force felt in free motion, RMS"},
    MetricName{"max_slew_N_per_ms", "fastest change of the felt force"},
    MetricName{"net_energy_J", "largest net work done on the hand"},
    MetricName{"felt_error_rms_N", "error of the felt force while engaged, RMS"},
    MetricName{"felt_error_rel", "error of the felt force while engaged, as a share of the true one"},
    MetricName{"felt_error_worst_N", "error of the felt force, worst mean over half a second"},
    MetricName{"felt_onset_ms", "delay until a contact or load is felt, slowest"},
    MetricName{"unfelt_s", "time in which the machine presses and the operator does not feel it"},
    MetricName{"unfelt_showable_s", "unfelt time in which the device could have shown the force"},
    MetricName{"free_felt_peak_N", "largest force felt in free motion"},
    MetricName{"home_opening", "widest valve opening on the way home on two"},
    MetricName{"home_speed", "fastest joint on the way home on two, of its limit"},
    MetricName{"contact_swing_N", "swing of the true force within a quarter of a second of contact, largest"},
    MetricName{"contact_bounces", "bounces on contact"},
    MetricName{"fault_rise_N", "rise of the true force after a fault, largest"},
    MetricName{"fault_slew_N_per_ms", "fastest change of the felt force after a fault"},
    MetricName{"peak_over_asked", "largest true force of a press over what it asks for"},
    MetricName{"engaged_s", "time engaged"},
    MetricName{"faults", "latched faults"},
    MetricName{"command_neutral_ms", "time from a fault to the neutral command, slowest"},
    MetricName{"spool_neutral_ms", "time from a fault to closed valves, slowest"},
    MetricName{"pieces_broken", "pieces broken"},
    MetricName{"phases_timed_out", "whether the operator's plan ran out of time"},
    MetricName{"resumed_by_itself", "faults after which motion resumed by itself"},
    MetricName{"records_lost", "records lost"},
    MetricName{"pump_short_share", "share of engaged time in which the pump delivered too little"},
};

constexpr std::array kHops{
    MetricName{"hand_to_master", "from the hand's device to the operator's side"},
    MetricName{"master_to_slave", "from the operator's side to the machine's"},
    MetricName{"hand_to_valve", "from the hand's device to the valves' wire"},
    MetricName{"pressure_to_slave", "from the pressures' wire to the estimated force"},
    MetricName{"slave_to_master", "from the machine's side to the operator's"},
    MetricName{"pressure_to_hand", "from the pressures' wire to the force in the hand"},
};

template <std::size_t N>
std::string text_of(const std::array<MetricName, N>& table, std::string_view name) {
  const auto known = std::find_if(table.begin(), table.end(), [name](const MetricName& w) { return w.first == name; });
  return std::string(known == table.end() ? name : known->second);
}

}  // namespace

std::string metric_text(std::string_view name) {
  return text_of(kMetrics, name);
}

std::string hop_text(std::string_view hop) {
  return text_of(kHops, hop);
}

namespace {

using session::CriterionKind;
using session::CriterionResult;

/// Rounded up, so that it is not more than what is true.
std::string within_kg(double error_kg) {
  return number_text(error_kg < 10 ? std::ceil(10 * error_kg) / 10 : std::ceil(error_kg)) + " kg";
}

std::string times_text(std::size_t count) {
  return count == 1 ? "once" : count == 2 ? "twice" : std::to_string(count) + " times";
}

std::string force_text(double force_N) {
  return force_N < 1000 ? shown(std::round(force_N), "N") : number_text(force_N / 1000, 2) + " kN";
}

bool happened(const session::SessionRecord& record, std::string_view event) {
  return std::ranges::find(record.events, event, &session::EventRecord::what) != record.events.end();
}

/// Of the load: lifted, weighed, put down. Empty where there was none.
std::string load_text(const session::Judged& judged) {
  constexpr double kLifted_kg = 1;
  const session::Metrics& m = judged.metrics;
  const session::SessionRecord& record = judged.session.record;
  if (m.payload_truth_kg.value_or(0) < kLifted_kg) return "";
  std::string text = shown(std::round(*m.payload_truth_kg), "kg") + (happened(record, "dug") ? " dug" : " lifted");
  if (m.payload_error_kg) {
    const bool weighed = std::ranges::find(record.phases, "weigh") != record.phases.end();
    text += std::string(weighed ? " and weighed" : ", known") + " within " + within_kg(*m.payload_error_kg);
  }
  const bool down = !record.samples.empty() && record.samples.back().truth.payload_kg < kLifted_kg;
  return text + (down ? ", put down" : "");
}

std::string contact_text(const session::Judged& judged) {
  const session::SessionRecord& record = judged.session.record;
  const std::size_t presses = session::press_windows(record).size();
  const std::string peak = force_text(judged.metrics.peak_N.value_or(0));
  if (presses > 0) return "pressed " + times_text(presses) + ", with up to " + peak;
  if (happened(record, "dug")) return "dug with up to " + peak;
  if (std::ranges::any_of(record.samples, session::in_contact)) return "touched with up to " + peak;
  return "moved freely for " + shown(std::round(judged.metrics.engaged_s.value_or(0)), "s");
}

std::string faults_text(const session::Judged& judged) {
  const std::size_t count = judged.session.record.faults.size();
  if (count == 0) return "no fault";
  std::string text = std::to_string(count) + (count == 1 ? " fault" : " faults");
  if (const auto& ms = judged.metrics.spool_neutral_ms) {
    const auto open = [](const session::FaultRecord& fault) { return fault.spool_neutral_s == 0; };
    const bool all_closed = std::ranges::none_of(judged.session.record.faults, open);
    text += all_closed ? ", valves closed within " + shown(std::ceil(*ms), "ms") : ", valves not closed";
    if (all_closed && count > 1) text += " each time";
  }
  const int resumed = judged.session.record.resumed_by_itself;
  return text + (resumed == 0 ? ", no motion resumed by itself"
                              : ", motion RESUMED BY ITSELF " + times_text(static_cast<std::size_t>(resumed)));
}

/// "3 of 3 safety bounds"; empty where there are none.
std::string share_text(const session::Judged& judged, CriterionKind kind, const char* one, const char* many) {
  std::size_t all = 0, met = 0;
  for (const CriterionResult& result : judged.criteria) {
    if (result.kind != kind || !result.met) continue;
    ++all;
    if (*result.met) ++met;
  }
  return all == 0 ? "" : fmt::format("{} of {} {}", met, all, all == 1 ? one : many);
}

}  // namespace

Sorted sorted(const session::Judged& judged) {
  Sorted by;
  for (const CriterionResult& result : judged.criteria) {
    auto& place = !result.met                                                ? by.open
                  : *result.met                                              ? by.met
                  : result.kind == CriterionKind::kGoal                      ? by.towards
                  : decides(result.kind, judged.session.requirements_decide) ? by.failed
                                                                             : by.shown;
    place.push_back(&result);
  }
  return by;
}

std::string plain_text(std::string_view name) {
  std::string text(name);
  std::ranges::replace(text, '_', ' ');
  return text;
}

std::string done_text(const session::Judged& judged) {
  const session::Metrics& m = judged.metrics;
  if (m.engaged_s.value_or(0) == 0) return "the machine was never engaged; " + faults_text(judged);
  std::vector<std::string> parts;
  const double broken = m.pieces_broken.value_or(0);
  if (broken > 0) parts.push_back(broken == 1 ? "piece broken off" : shown(broken, "pieces broken off"));
  if (const std::string load = load_text(judged); !load.empty()) parts.push_back(load);
  if (parts.empty()) parts.push_back(contact_text(judged));
  if (judged.session.record.phases_timed_out > 0 && !judged.session.record.cut_short)
    parts.emplace_back("a phase of the plan ran out of time");
  return fmt::format("{}; {}", fmt::join(parts, ", "), faults_text(judged));
}

std::string verdict_text(const session::Judged& judged) {
  if (!judged.passed) return "ended by --duration: not judged";
  std::string met;
  const auto add = [&](const std::string& share) {
    if (!share.empty()) met += (met.empty() ? ": " : ", ") + share;
  };
  add(share_text(judged, CriterionKind::kSafety, "safety bound", "safety bounds"));
  add(share_text(judged, CriterionKind::kCriterion, "criterion", "criteria"));
  if (judged.session.requirements_decide)
    add(share_text(judged, CriterionKind::kRequirement, "requirement", "requirements"));
  if (met.empty()) return judged.criteria.empty() ? "nothing was asked for" : "nothing that decides was asked for";
  return (*judged.passed ? "passed" : "NOT passed") + met + " met";
}

std::string goals_text(const session::Judged& judged) {
  const auto is_goal = [](const CriterionResult& result) { return result.kind == CriterionKind::kGoal && result.met; };
  const auto missed = [&](const CriterionResult& result) { return is_goal(result) && result.missed(); };
  return fmt::format("{} of {} goals not reached", std::ranges::count_if(judged.criteria, missed),
                     std::ranges::count_if(judged.criteria, is_goal));
}

std::string measured_text(const CriterionResult& result) {
  if (!result.value) return "not measured";
  return *result.value == std::numeric_limits<double>::infinity() ? "never" : shown(result.value, result.unit);
}

std::string value_text(const CriterionResult& result) {
  const bool goal = result.kind == CriterionKind::kGoal;
  const std::string bound = std::string(goal ? "goal " : "") + (result.relation == "min" ? "at least "
                                                                : goal                   ? ""
                                                                                         : "at most ");
  return measured_text(result) + ", " + bound + shown(result.bound, result.unit);
}

std::string excuse_text(const CriterionResult& result, const session::Metrics& metrics) {
  if (result.name != "unfelt_s" || result.value.value_or(0) == 0 || !metrics.unfelt_showable_s) return "";
  const double not_shown_s = std::round(1e3 * (*result.value - *metrics.unfelt_showable_s)) / 1e3;
  return "the device cannot show " + shown(not_shown_s, "s") + " of it";
}

std::string moment_text(const CriterionResult& result) {
  if (!result.at_s) return "";
  return fmt::format("{:.1f} s", *result.at_s) + (result.phase.empty() ? "" : ", " + plain_text(result.phase));
}

namespace {

std::string what_ran(const session::SessionResult& s) {
  const double speed = s.wall_s > 0 ? s.simulated_s / s.wall_s : 0.0;
  return fmt::format("{} on {}, seed {}: {:.1f} s simulated in {:.2f} s ({:.{}f} x real time)\n", s.scenario,
                     s.machine_name, s.seed, s.simulated_s, s.wall_s, speed, speed < 10 ? 1 : 0);
}

std::string line_of(const CriterionResult& result, const session::Metrics& metrics) {
  const std::string excuse = excuse_text(result, metrics), moment = moment_text(result);
  return fmt::format("    {}: {}{}{} [{}]\n", metric_text(result.name), value_text(result),
                     excuse.empty() ? "" : "; " + excuse, moment.empty() ? "" : "; at " + moment, result.name);
}

std::string block(const std::string& title, const std::vector<const CriterionResult*>& results,
                  const session::Metrics& metrics) {
  if (results.empty()) return "";
  std::string text = "  " + title + "\n";
  for (const CriterionResult* result : results) text += line_of(*result, metrics);
  return text;
}

/// A wall that held is seldom meant, so it is always told; other limits are part of every session.
std::string limits_line(const session::SessionResult& session, bool all) {
  constexpr double kWorthTelling_s = 0.1;
  std::string list;
  for (const session::LimitTime& one : session::limit_times(session.record, session.machine.limits)) {
    if (one.time_s >= kWorthTelling_s && (one.wall || all))
      list += fmt::format("{}{} for {:.1f} s", list.empty() ? "" : ", ", one.limit, one.time_s);
  }
  return list.empty() ? "" : "  held back by limits: " + list + "\n";
}

}  // namespace

std::string shown(const std::optional<double>& value, const std::string& unit) {
  if (!value) return "-";
  return number_text(*value) + (unit == "1" ? "" : " " + unit);
}

std::string summary_text(const session::Judged& judged, const std::string& report, bool verbose) {
  const session::SessionResult& s = judged.session;
  const Sorted by = sorted(judged);
  std::string text = what_ran(s) + "  " + done_text(judged) + "\n";
  for (const std::string& note : s.notes) text += "  note: " + note + "\n";
  for (const session::FaultRecord& f : s.record.faults)
    text += fmt::format("  fault at {:.2f} s: ", f.at_s) + knuckle::text(f.reason, s.machine.bus) + "\n";
  for (const session::WarningRecord& w : s.record.warnings)
    text += fmt::format("  warning at {:.2f} s: ", w.at_s) + knuckle::text(w.reason, s.machine.bus) + "\n";
  text += limits_line(s, verbose);
  text += block("FAILED:", by.failed, judged.metrics);
  if (std::ranges::any_of(by.failed, [](const auto* r) { return r->kind == CriterionKind::kRequirement; }))
    text += "  one session in 40 may miss a requirement: see what other seeds do\n";
  text +=
      block("requirements not met; they decide with the default machine, or with --judge:", by.shown, judged.metrics);
  text += block(goals_text(judged) + ":", by.towards, judged.metrics);
  if (verbose) text += block("met:", by.met, judged.metrics) + block("not judged:", by.open, judged.metrics);
  text += verdict_text(judged) + "\n";
  if (!s.log.file.empty() && s.log.problem.empty()) text += "recording: " + s.log.file + "\n";
  if (!report.empty()) text += "report: " + report + "\n";
  return text;
}

}  // namespace knuckle::report
