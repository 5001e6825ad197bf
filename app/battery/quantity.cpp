#include "app/battery/quantity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/quantile.h"
#include "core/units.h"

namespace knuckle::battery {
namespace {

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

/// Of parts and wholes by turns. NaN where the whole is nothing.
double ratio(double scale, const std::vector<double>& values) {
  double part = 0, whole = 0;
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    part += values[i];
    whole += values[i + 1];
  }
  return whole > 0 ? scale * part / whole : kUnknown;
}

}  // namespace

const char* name(By by) noexcept {
  constexpr std::array kNames{"median", "p90", "p95", "worst", "share", "ratio", "rms"};
  return kNames.at(static_cast<std::size_t>(by));
}

std::string Quantity::target() const {
  if (low == -kNever) return high == kNever ? "" : fmt::format("<= {:g}", high);
  return high == kNever ? fmt::format(">= {:g}", low) : fmt::format("{:g} to {:g}", low, high);
}

std::vector<double> values_of(const Quantity& quantity, const Sources& sources) {
  std::vector<double> values;
  const auto add = [&](const Row& value) {
    values.push_back(value.is_number() ? value.get<double>() : quantity.missing);
  };
  for (const Row* metrics : sources) {
    const auto found = metrics->find(quantity.metric);
    if (found == metrics->end()) continue;
    if (found->is_array())
      std::for_each(found->begin(), found->end(), add);
    else
      add(*found);
  }
  return values;
}

double value_of(const Quantity& quantity, const Sources& sources) {
  const std::vector<double> values = values_of(quantity, sources);
  switch (quantity.by) {
    case By::kMedian:
      return quantity.scale * median(values);
    case By::kP90:
      return quantity.scale * quantile(values, 0.9);
    case By::kP95:
      return quantity.scale * quantile(values, 0.95);
    case By::kWorst:
      return quantity.scale * quantile(values, 1);
    case By::kShare:
      return quantity.scale * static_cast<double>(std::count(values.begin(), values.end(), 1)) /
             static_cast<double>(values.size());
    case By::kRatio:
      return ratio(quantity.scale, values);
    case By::kRms:
      return quantity.scale * rms(values) / quantity.whole;
  }
  return kUnknown;
}

}  // namespace knuckle::battery
