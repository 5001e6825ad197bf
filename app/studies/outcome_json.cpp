#include "app/studies/outcome_json.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"

namespace knuckle::studies {
namespace {

using Json = nlohmann::ordered_json;

// The fields of each type, for both ways: `field` is called with each name and value. A structured binding has to name
// every field: one that is forgotten here does not compile.

template <typename Fields>
void each(PressScore& s, const Fields& field) {
  auto& [force_N, error_N, direction_deg, creeping, covered, taken_for_load_N] = s;
  field("force_N", force_N);
  field("error_N", error_N);
  field("direction_deg", direction_deg);
  field("creeping", creeping);
  field("covered", covered);
  field("taken_for_load_N", taken_for_load_N);
}

template <typename Fields>
void each(ContactModelScore& s, const Fields& field) {
  auto& [model, presses, torque_Nm, place_error_m] = s;
  field("model", model);
  field("presses", presses);
  field("torque_Nm", torque_Nm);
  field("place_error_m", place_error_m);
}

template <typename Fields>
void each(ForceScores& s, const Fields& field) {
  auto& [slow_rms_N, slow_p95_N, digging_rms_N, presses, contact_models, detection_s, false_alarms, free_s, looks,
         covered, payload_error_kg, payload_sigma_kg, nis] = s;
  field("slow_rms_N", slow_rms_N);
  field("slow_p95_N", slow_p95_N);
  field("digging_rms_N", digging_rms_N);
  field("presses", presses);
  field("contact_models", contact_models);
  field("detection_s", detection_s);
  field("false_alarms", false_alarms);
  field("free_s", free_s);
  field("looks", looks);
  field("covered", covered);
  field("payload_error_kg", payload_error_kg);
  field("payload_sigma_kg", payload_sigma_kg);
  field("nis", nis);
}

template <typename Fields>
void each(estimation::TorqueFit& s, const Fields& field) {
  auto& [rms_Nm, nrmse, vaf] = s;
  field("rms_Nm", rms_Nm);
  field("nrmse", nrmse);
  field("vaf", vaf);
}

template <typename Fields>
void each(identify::ParameterScores& s, const Fields& field) {
  auto& [gravity, inertia, friction, intervals, covered] = s;
  field("gravity", gravity);
  field("inertia", inertia);
  field("friction", friction);
  field("intervals", intervals);
  field("covered", covered);
}

template <typename Fields>
void each(CommissionScores& s, const Fields& field) {
  auto& [tip_median_m, nominal_tip_median_m, lever, nominal_lever, dead_band, delay_s, flow] = s;
  field("tip_median_m", tip_median_m);
  field("nominal_tip_median_m", nominal_tip_median_m);
  field("lever", lever);
  field("nominal_lever", nominal_lever);
  field("dead_band", dead_band);
  field("delay_s", delay_s);
  field("flow", flow);
}

template <typename Fields>
void each(MethodOutcome& s, const Fields& field) {
  auto& [method, identified, usable, reason, force, torque_2Hz, torque_raw, parameters] = s;
  field("method", method);
  field("identified", identified);
  field("usable", usable);
  field("reason", reason);
  field("force", force);
  field("torque_2Hz", torque_2Hz);
  field("torque_raw", torque_raw);
  field("parameters", parameters);
}

template <typename Fields>
void each(MachineOutcome& s, const Fields& field) {
  auto& [seed, failure, commissioning, methods] = s;
  field("seed", seed);
  field("failure", failure);
  field("commissioning", commissioning);
  field("methods", methods);
}

// JSON has neither NaN nor infinity: they are words.
Json written(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}
void read(const Json& json, double& value) {
  if (json.is_number()) {
    json.get_to(value);
    return;
  }
  const std::string word = json.get<std::string>();
  if (word != "nan" && word != "inf" && word != "-inf") throw InputError("\"" + word + "\" is no number");
  const double infinity = std::numeric_limits<double>::infinity();
  value = word == "nan" ? std::numeric_limits<double>::quiet_NaN() : word == "inf" ? infinity : -infinity;
}

template <typename T>
constexpr bool kPlain = std::is_same_v<T, bool> || std::is_same_v<T, int> || std::is_same_v<T, std::uint64_t> ||
                        std::is_same_v<T, std::string>;

template <typename T>
Json written(T& value);
template <typename T>
void read(const Json& json, T& value);

Json written(JointVector& value) {
  return {written(value[0]), written(value[1]), written(value[2])};
}
void read(const Json& json, JointVector& value) {
  for (std::size_t i = 0; i < kJoints; ++i) read(json.at(i), value[static_cast<Eigen::Index>(i)]);
}

template <typename T>
Json written(std::vector<T>& values) {
  Json json = Json::array();
  for (T& value : values) json.push_back(written(value));
  return json;
}
template <typename T>
void read(const Json& json, std::vector<T>& values) {
  if (!json.is_array()) throw InputError("no list");
  values.assign(json.size(), T{});
  for (std::size_t i = 0; i < values.size(); ++i) read(json.at(i), values[i]);
}

template <typename T>
Json written(std::optional<T>& value) {
  return value ? written(*value) : Json();
}
template <typename T>
void read(const Json& json, std::optional<T>& value) {
  value.reset();
  if (!json.is_null()) read(json, value.emplace());
}

template <typename T>
Json written(T& value) {
  if constexpr (kPlain<T>) {
    return value;
  } else {
    Json json = Json::object();
    each(value, [&json](const char* name, auto& part) { json[name] = written(part); });
    return json;
  }
}
template <typename T>
void read(const Json& json, T& value) {
  if constexpr (kPlain<T>) {
    if (std::is_integral_v<T> && !json.is_boolean() && !json.is_number_integer()) throw InputError("no whole number");
    json.get_to(value);
  } else {
    each(value, [&json](const char* name, auto& part) { read(json.at(name), part); });
  }
}

}  // namespace

Json to_json(MachineOutcome outcome) {
  return written(outcome);
}

MachineOutcome outcome_of(const Json& json) {
  MachineOutcome outcome;
  try {
    read(json, outcome);
  } catch (const Json::exception& error) {
    throw InputError(std::string("no judged machine: ") + error.what());
  }
  for (const MethodOutcome& method : outcome.methods) {
    if (method.force.payload_error_kg.size() != method.force.payload_sigma_kg.size())
      throw InputError("no judged machine: lists of unlike length");
  }
  return outcome;
}

}  // namespace knuckle::studies
