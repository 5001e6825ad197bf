#include "app/battery/settings.h"

#include <nlohmann/json.hpp>

#include "app/session/scenario.h"
#include "core/error.h"
#include "machine/device_description.h"
#include "machine/toml_reader.h"
#include "sim/person.h"
#include "sim/truth.h"

namespace knuckle::battery {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostChoices = 64;
constexpr std::int64_t kMostSessions = 1'000'000;

Span read_span(TomlTable& file, const char* key, double min, double max) {
  const auto bounds = file.numbers<2>(key, min, max);
  file.require(bounds[0] <= bounds[1], key, "must be [low, high]");
  return {bounds[0], bounds[1]};
}

void read_feel(TomlTable& file, Settings& settings) {
  settings.stiffness_N_per_m = read_span(file, "stiffness_N_per_m", 1e4, 1e8);
  settings.speed_mps = read_span(file, "speed_mps", 0.01, 1);
  settings.felt_N = read_span(file, "felt_N", 0.1, 20);
}

void read_work(TomlTable& file, Settings& settings) {
  for (TomlTable& table : file.tables("scenario")) settings.scenarios.push_back(table.text("name"));
  file.require(!settings.scenarios.empty(), "scenario", "at least one [[scenario]] is needed");
}

/// @throws InputError naming file, key, value and bound.
double within(double value, const char* key, double min, double max, const std::string& source) {
  if (value >= min && value <= max) return value;
  throw InputError(source + ": settings: " + key + " = " + number_text(value) + ": must be within [" +
                   number_text(min) + ", " + number_text(max) + "]");
}

Span span_within(const Json& json, const char* key, double min, double max, const std::string& source) {
  const Span span{within(json.at(key).at(0).get<double>(), key, min, max, source),
                  within(json.at(key).at(1).get<double>(), key, min, max, source)};
  if (span.low > span.high)
    throw InputError(source + ": settings: " + key + " = " + json.at(key).dump() + ": must be [low, high]");
  return span;
}

std::vector<double> list_within(const Json& json, const char* key, double max, const std::string& source) {
  const auto list = json.at(key).get<std::vector<double>>();
  if (list.empty()) throw InputError(source + ": settings: " + key + " = []: must have at least one value");
  for (const double value : list) (void)within(value, key, 0, max, source);
  return list;
}

Json span_json(const Span& span) {
  return Json::array({span.low, span.high});
}

}  // namespace

const char* name(Kind kind) noexcept {
  return kind == Kind::kFeel ? "feel" : "work";
}

Settings load_settings(const std::string& path) {
  TomlTable file = TomlTable::read_kind("grid", path);
  Settings settings;
  settings.kind = static_cast<Kind>(file.choice("battery", {"feel", "work"}));
  settings.sessions = static_cast<std::uint64_t>(file.integer("sessions", 1, kMostSessions));
  settings.seed = static_cast<std::uint64_t>(file.integer("seed", 1, kMostSeed));
  settings.machine = file.text("machine");
  settings.family = sim::name(static_cast<sim::Family>(file.choice("family", {"smooth", "serviced", "worn"})));
  settings.person = sim::name(static_cast<sim::PersonClass>(file.choice("person", {"exact", "steady", "rough"})));
  settings.rtt_ms = file.list("rtt_ms", 1, kMostChoices, 0, 2 * session::kLongestDelay_ms);
  settings.jitter_ms = file.list("jitter_ms", 1, kMostChoices, 0, session::kLongestDelay_ms);
  settings.loss = file.list("loss", 1, kMostChoices, 0, 1);
  settings.bursts_per_s = file.list("bursts_per_s", 1, kMostChoices, 0, 10);
  for (TomlTable& table : file.tables("commissioned"))
    settings.commissioned.push_back(
        {table.text("file"), static_cast<std::uint64_t>(table.integer("seed", 1, kMostSeed))});
  if (file.has("control")) settings.control = name(static_cast<ControlLaw>(file.choice("control", kControlLawNames)));
  if (!file.sound({"battery"})) {
    file.leave_rest();
  } else {
    if (settings.kind == Kind::kFeel)
      read_feel(file, settings);
    else
      read_work(file, settings);
  }
  file.finish();
  return settings;
}

Json settings_json(const Settings& settings) {
  Json json{{"battery", name(settings.kind)}, {"sessions", settings.sessions},
            {"seed", settings.seed},          {"machine", settings.machine},
            {"family", settings.family},      {"person", settings.person},
            {"rtt_ms", settings.rtt_ms},      {"jitter_ms", settings.jitter_ms},
            {"loss", settings.loss},          {"bursts_per_s", settings.bursts_per_s}};
  for (const CommissionedMachine& machine : settings.commissioned)
    json["commissioned"].push_back({{"file", machine.file}, {"seed", machine.seed}});
  if (!settings.control.empty()) json["control"] = settings.control;
  if (settings.kind == Kind::kFeel) {
    json["stiffness_N_per_m"] = span_json(settings.stiffness_N_per_m);
    json["speed_mps"] = span_json(settings.speed_mps);
    json["felt_N"] = span_json(settings.felt_N);
  } else {
    json["scenarios"] = settings.scenarios;
  }
  return json;
}

Settings settings_of(const Json& json, const std::string& source) {
  try {
    Settings settings;
    const auto kind = json.at("battery").get<std::string>();
    if (kind != "feel" && kind != "work") throw InputError(source + ": battery '" + kind + "' has no cells");
    settings.kind = kind == "feel" ? Kind::kFeel : Kind::kWork;
    for (const char* count : {"sessions", "seed"}) {
      if (!json.at(count).is_number_unsigned() || json.at(count) < 1)
        throw InputError(source + ": settings: " + count + " = " + json.at(count).dump() + ": must be 1 or more");
    }
    json.at("sessions").get_to(settings.sessions);
    json.at("seed").get_to(settings.seed);
    json.at("machine").get_to(settings.machine);
    json.at("family").get_to(settings.family);
    json.at("person").get_to(settings.person);
    if (json.contains("commissioned")) {
      for (const Json& machine : json["commissioned"]) {
        const auto seed = machine.at("seed").get<std::int64_t>();
        if (seed < 1)
          throw InputError(source + ": settings: commissioned: seed = " + machine.at("seed").dump() +
                           ": must be 1 or more");
        settings.commissioned.push_back({machine.at("file").get<std::string>(), static_cast<std::uint64_t>(seed)});
      }
    }
    settings.control = json.value("control", "");
    settings.rtt_ms = list_within(json, "rtt_ms", 2 * session::kLongestDelay_ms, source);
    settings.jitter_ms = list_within(json, "jitter_ms", session::kLongestDelay_ms, source);
    settings.loss = list_within(json, "loss", 1, source);
    settings.bursts_per_s = list_within(json, "bursts_per_s", 10, source);
    if (settings.kind == Kind::kFeel) {
      settings.stiffness_N_per_m = span_within(json, "stiffness_N_per_m", 1e4, 1e8, source);
      settings.speed_mps = span_within(json, "speed_mps", 0.01, 1, source);
      settings.felt_N = span_within(json, "felt_N", 0.1, 20, source);
    } else {
      json.at("scenarios").get_to(settings.scenarios);
    }
    if (settings.kind == Kind::kWork && settings.scenarios.empty())
      throw InputError(source + ": settings: no scenarios");
    return settings;
  } catch (const nlohmann::json::exception&) {
    throw InputError(source + ": is not a result of knuckle-studies sweep --battery feel or work");
  }
}

}  // namespace knuckle::battery
