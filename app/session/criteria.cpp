#include "app/session/criteria.h"

#include <algorithm>

namespace knuckle::session {
namespace {

CriterionResult judged(const MetricEntry& entry, const Metric& value, const char* relation, double bound, bool met) {
  return {std::string(entry.name), value, std::string(entry.unit), relation, bound, met};
}

}  // namespace

std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics) {
  std::vector<CriterionResult> results;
  for (const Criterion& c : criteria) {
    const MetricEntry& entry = *find_metric(c.metric);
    const Metric& value = metrics.*entry.member;
    // Written so that a NaN fails.
    if (c.min) results.push_back(judged(entry, value, "min", *c.min, value && *value >= *c.min));
    if (c.max) results.push_back(judged(entry, value, "max", *c.max, value && *value <= *c.max));
  }
  return results;
}

bool all_passed(const std::vector<CriterionResult>& results) noexcept {
  return std::all_of(results.begin(), results.end(), [](const CriterionResult& r) { return r.passed; });
}

}  // namespace knuckle::session
