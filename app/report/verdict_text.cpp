#include "app/report/verdict_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/report/number_text.h"
#include "app/report/summary.h"
#include "app/session/record_windows.h"

namespace knuckle::report {
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
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text + "; " + faults_text(judged);
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

}  // namespace knuckle::report
