#include "app/battery/effects.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace knuckle::battery {
namespace {

constexpr const char* kMetrics[] = {"felt_error_rel",  "hold_error_N", "contact_swing_N",
                                    "peak_over_asked", "tip_rms_m",    "no_load_rms_N"};
constexpr std::size_t kFewest = 10;  // fewer sessions say nothing

template <typename Get>
double mean(const Get& get) {
  double sum = 0;
  for (std::size_t i = 0; i < kJoints; ++i) sum += get(i) / kJoints;
  return sum;
}

/// Ranks from 0, equal values sharing the mean of theirs.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> rank(values.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last + 1 < order.size() && values[order[last + 1]] == values[order[first]]) ++last;
    for (std::size_t k = first; k <= last; ++k) rank[order[k]] = 0.5 * static_cast<double>(first + last);
    first = last + 1;
  }
  return rank;
}

/// Nothing where either does not vary.
std::optional<double> rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double middle = 0.5 * static_cast<double>(x.size() - 1);
  double xy = 0, xx = 0, yy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - middle) * (y[i] - middle);
    xx += (x[i] - middle) * (x[i] - middle);
    yy += (y[i] - middle) * (y[i] - middle);
  }
  if (xx <= 0 || yy <= 0) return std::nullopt;
  return xy / std::sqrt(xx * yy);
}

std::optional<Sensitivity> sensitivity(const Rows& rows, const std::string& effect, const char* metric) {
  std::vector<double> values, results;
  for (const auto& [index, row] : rows) {
    const auto result = metric_of(row, metric);
    if (!result || !row.contains("effects") || !row["effects"].contains(effect)) continue;
    values.push_back(row["effects"][effect].get<double>());
    results.push_back(*result);
  }
  if (values.size() < kFewest) return std::nullopt;
  const auto correlation = rank_correlation(values, results);
  if (!correlation) return std::nullopt;
  return Sensitivity{effect, metric, *correlation, values.size()};
}

}  // namespace

bool Sensitivity::is_plain() const noexcept {
  constexpr double kDeviations = 3.9;  // 1e-4 each, two-sided
  return std::abs(correlation) * std::sqrt(static_cast<double>(of - 1)) > kDeviations;
}

nlohmann::ordered_json effects_of(const sim::MachineTruth& truth) {
  const auto& valve = truth.valve;
  const auto& friction = truth.friction;
  double offset_Pa = 0;
  for (const sim::PressureSensorError& sensor : truth.pressure)
    offset_Pa = std::max(offset_Pa, std::abs(sensor.offset_Pa));
  return {{"valve curve exponent", mean([&](std::size_t i) { return valve[i].curve_exponent; })},
          {"notch slope", mean([&](std::size_t i) { return valve[i].notch_slope; })},
          {"retract gain", mean([&](std::size_t i) { return valve[i].retract_gain; })},
          {"hysteresis", mean([&](std::size_t i) { return truth.machine.cylinders[i].valve.hysteresis; })},
          {"stiction", mean([&](std::size_t i) { return valve[i].stiction; })},
          {"leakage", mean([&](std::size_t i) { return valve[i].leakage_m3ps_per_Pa; })},
          {"sliding friction", mean([&](std::size_t i) { return friction[i].coulomb_extend_N; })},
          {"seal friction", mean([&](std::size_t i) { return friction[i].seal_N_per_Pa; })},
          {"pin friction", mean([&](std::size_t i) { return friction[i].pin_share; })},
          {"pin play", mean([&](std::size_t i) { return truth.pin[i].play_m; })},
          {"ground stiffness", truth.hull.stiffness_N_per_m},
          {"settling", truth.hull.settling_m_per_N},
          {"viscosity", truth.viscosity_factor},
          {"bulk modulus", truth.machine.hydraulics.bulk_modulus_Pa},
          {"cross-talk", truth.cross_talk},
          {"pump ripple", truth.pump.ripple_Pa},
          {"transmitter offset", offset_Pa},
          {"encoder slack", truth.encoder_slack_m.mean()},
          {"encoder offset", truth.encoder_offset_m.cwiseAbs().mean()},
          {"hull slope", std::abs(truth.hull_pitch_rad)}};
}

std::vector<Sensitivity> sensitivities(const Rows& rows) {
  std::vector<Sensitivity> found;
  const auto with =
      std::find_if(rows.begin(), rows.end(), [](const auto& row) { return row.second.contains("effects"); });
  if (with == rows.end()) return found;
  for (const auto& [effect, unused] : with->second["effects"].items()) {
    for (const char* metric : kMetrics) {
      if (const auto one = sensitivity(rows, effect, metric)) found.push_back(*one);
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const Sensitivity& a, const Sensitivity& b) {
    return std::abs(a.correlation) > std::abs(b.correlation);
  });
  return found;
}

}  // namespace knuckle::battery
