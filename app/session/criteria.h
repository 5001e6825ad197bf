// What a scenario asks of a session: bounds on metrics, and the verdict.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/session/metrics.h"

namespace knuckle::session {

/// One [[criteria]] entry of a scenario. At least one bound is set.
struct Criterion {
  std::string metric;  ///< Name of a metric, as in metric_table().
  std::optional<double> min, max;
};

/// One bound checked. A metric the session could not measure fails its criterion.
struct CriterionResult {
  std::string name;
  std::optional<double> value;
  std::string unit;
  std::string relation;  ///< "max" or "min"
  double bound = 0;
  bool passed = false;
};

/// One result per bound, in the order given.
/// @param criteria of metrics that find_metric knows.
[[nodiscard]] std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics);

[[nodiscard]] bool all_passed(const std::vector<CriterionResult>& results) noexcept;

}  // namespace knuckle::session
