#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "app/recordings/state_table.h"
#include "app/report/report.h"
#include "app/session/record_windows.h"
#include "core/fields.h"
#include "machine/reason_text.h"

namespace knuckle::report {
namespace {

using cli::Json;

Json number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json();
}

/// Counts are whole numbers in JSON too.
Json metric_json(const session::MetricEntry& entry, const session::Metrics& metrics) {
  const session::Metric& value = metrics.*entry.member;
  const bool counts = entry.unit == "1" && (entry.key == "contact_losses" || entry.key == "faults" ||
                                            entry.key == "pieces_broken" || entry.key == "records_lost");
  return counts && value ? Json(std::llround(*value)) : number(value);
}

/// Those of one kind. @param verdict the key that says whether it was met.
Json criteria_json(const std::vector<session::CriterionResult>& criteria, session::CriterionKind kind,
                   const char* verdict = "passed") {
  Json list = Json::array();
  for (const session::CriterionResult& c : criteria) {
    if (c.kind != kind) continue;
    list.push_back({{"name", c.name},
                    {"value", number(c.value)},
                    {"unit", c.unit},
                    {"relation", c.relation},
                    {"bound", c.bound},
                    {verdict, c.met ? Json(*c.met) : Json()},
                    {"at_s", number(c.at_s)},
                    {"phase", c.phase.empty() ? Json() : Json(c.phase)}});
  }
  return list;
}

Json percentiles_json(const session::Percentiles& p) {
  return {{"p50", p.p50}, {"p99", p.p99}, {"max", p.max}};
}

Json faults_json(const session::SessionRecord& record, const BusDescription& bus) {
  Json list = Json::array();
  for (const session::FaultRecord& f : record.faults) {
    const auto since_ms = [&](double at_s) { return at_s > 0 ? Json(1e3 * (at_s - f.last_good_input_s)) : Json(); };
    list.push_back(
        {{"code", name(f.reason.code)},
         {"reason", text(f.reason, bus)},
         {"at_s", f.at_s},
         {"last_good_input", f.last_good_input_s},
         {"command_neutral_ms", since_ms(f.command_neutral_s)},
         {"spool_neutral_ms", since_ms(f.spool_neutral_s)},
         {"injected_at", f.injected_s ? Json(*f.injected_s) : Json()},
         {"since_injection_ms",
          f.injected_s && f.spool_neutral_s > 0 ? Json(1e3 * (f.spool_neutral_s - *f.injected_s)) : Json()}});
  }
  return list;
}

Json warnings_json(const session::SessionRecord& record, const BusDescription& bus) {
  Json list = Json::array();
  for (const session::WarningRecord& w : record.warnings)
    list.push_back({{"code", name(w.reason.code)}, {"reason", text(w.reason, bus)}, {"at_s", w.at_s}});
  return list;
}

Json latencies_json(const std::vector<session::HopLatency>& hops) {
  Json object = Json::object();
  for (const session::HopLatency& h : hops) {
    object[h.hop] = percentiles_json(h.latency_us);
    object[h.hop]["samples"] = h.samples;
  }
  return object;
}

Json realtime_json(const std::vector<session::LoopTiming>& loops) {
  if (loops.empty()) return Json();
  Json object = Json::object();
  for (const session::LoopTiming& l : loops)
    object[l.loop] = {{"policy", l.policy},
                      {"wake_us", percentiles_json(l.wake_us)},
                      {"execution_us", percentiles_json(l.execution_us)},
                      {"overruns", l.overruns}};
  return object;
}

Json modes_json(const session::SessionRecord& record) {
  Json list = Json::array();
  for (const session::ModeVisit& visit : session::modes_visited(record))
    list.push_back({{"mode", name(visit.mode)}, {"at_s", visit.at_s}, {"duration_s", visit.duration_s}});
  return list;
}

Json events_json(const session::SessionRecord& record) {
  Json list = Json::array();
  for (const session::EventRecord& event : record.events) list.push_back({{"at_s", event.t_s}, {"what", event.what}});
  return list;
}

/// "force ceiling" becomes force_ceiling.
Json limits_json(const session::SessionResult& session) {
  Json object = Json::object();
  for (session::LimitTime& one : session::limit_times(session.record, session.machine.limits)) {
    std::replace(one.limit.begin(), one.limit.end(), ' ', '_');
    object[one.limit] = one.time_s;
  }
  return object;
}

Json energy_json(const session::SessionRecord& record) {
  const session::PortEnergies e = session::port_energies(record);
  const auto port = [](double in_J, double out_J) {
    return Json{{"in_J", in_J}, {"out_J", out_J}, {"net_J", in_J - out_J}};
  };
  return {{"hand", port(e.hand_in_J, e.hand_out_J)}, {"machine", port(e.machine_in_J, e.machine_out_J)}};
}

/// Home on two: first offered, chosen, and what it was refused for; null: never offered.
Json home_json(const session::SessionRecord& record, const BusDescription& bus) {
  std::optional<double> offered_s, chosen_s;
  Reason refused;
  Json refusals = Json::array();
  for (const session::Sample& s : record.samples) {
    const slave::SlaveState& m = s.machine;
    if (m.home_offered && !offered_s) offered_s = s.t_s;
    if (m.home_on_two && !chosen_s) chosen_s = s.t_s;
    const bool blocked = m.home_offered && m.blocking.code != ReasonCode::kHomeOffered;
    if (blocked && !same_cause(m.blocking, refused))
      refusals.push_back({{"code", name(m.blocking.code)}, {"reason", text(m.blocking, bus)}, {"at_s", s.t_s}});
    refused = blocked ? m.blocking : Reason{};
  }
  if (!offered_s) return {};
  return {{"offered_at_s", *offered_s}, {"chosen_at_s", number(chosen_s)}, {"refused", std::move(refusals)}};
}

}  // namespace

Json result_json(const session::Judged& judged) {
  const session::SessionResult& s = judged.session;
  Json json{{"schema", kResultSchema}, {"version", KNUCKLE_VERSION}};
  json["versions"] = {{"knuckle", KNUCKLE_VERSION}, {"compiler", __VERSION__}};
  json["scenario"] = s.scenario;
  json["machine"] = s.machine_name;
  json["device"] = s.device_name;
  json["operator"] = s.operator_name;
  json["person"] = s.person;
  json["family"] = s.family;
  json["control"] = s.control;
  json["contact_model"] = name(s.machine.force.contact_model);
  json["seed"] = s.seed;
  json["machine_seed"] = s.machine_seed;
  json["link"] = {
      {"delay_ms", s.delay_ms}, {"jitter_ms", s.jitter_ms}, {"loss", s.loss}, {"bursts_per_s", s.bursts_per_s}};
  if (!s.impairment.empty()) json["link"]["impairment"] = s.impairment;
  json["digest"] = s.digest.whole;
  for (const session::SessionDigest::Line& line : s.digest.lines) json["digests"][line.field] = line.digest;
  json["passed"] = judged.passed ? Json(*judged.passed) : Json();
  json["requirements_decide"] = s.requirements_decide;
  json["safety"] = criteria_json(judged.criteria, session::CriterionKind::kSafety);
  json["criteria"] = criteria_json(judged.criteria, session::CriterionKind::kCriterion);
  json["requirements"] = criteria_json(judged.criteria, session::CriterionKind::kRequirement);
  json["goals"] = criteria_json(judged.criteria, session::CriterionKind::kGoal, "reached");
  json["timing"] = {{"simulated_s", s.simulated_s},
                    {"wall_s", s.wall_s},
                    {"real_time_factor", s.wall_s > 0 ? Json(s.simulated_s / s.wall_s) : Json()}};
  for (const session::MetricEntry& entry : session::metric_table())
    json[std::string(entry.group)][std::string(entry.key)] = metric_json(entry, judged.metrics);
  json["faults"] = faults_json(s.record, s.machine.bus);
  json["home_on_two"] = home_json(s.record, s.machine.bus);
  json["warnings"] = warnings_json(s.record, s.machine.bus);
  json["realtime"] = realtime_json(s.loops);
  json["latency_us"] = latencies_json(s.hops);
  json["energy"] = energy_json(s.record);
  json["modes"] = modes_json(s.record);
  json["events"] = events_json(s.record);
  json["limits_s"] = limits_json(s);
  json["notes"] = s.notes;
  return json;
}

void write_csv(const session::SessionRecord& record, std::ostream& out) {
  constexpr std::array<std::string_view, 1> kPhase{"phase"};  // by its name
  std::vector<Field> fields = fields_of<session::Sample>();
  std::erase_if(fields, [&](const Field& field) { return field.name == kPhase[0]; });
  recordings::StateTable table(out, fields, kPhase);
  for (session::Sample sample : record.samples) {
    const std::array<std::string_view, 1> phase{session::phase_name(record, sample)};
    recordings::show_unknown(sample.machine);
    if (sample.truth.contact_m.isZero(0)) sample.truth.contact_m.setConstant(std::nan(""));
    table.add(&sample, phase);
  }
}

}  // namespace knuckle::report
