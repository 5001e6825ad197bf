#include "app/session/criteria.h"

#include <algorithm>

#include "core/error.h"

namespace knuckle::session {
namespace {

CriterionResult judged(const MetricEntry& entry, const Metric& value, const char* relation, double bound, bool met) {
  return {std::string(entry.name), value, std::string(entry.unit), relation, bound, met};
}

}  // namespace

void check_criteria(const std::vector<Criterion>& criteria, const std::string& source) {
  for (const Criterion& c : criteria) {
    if (find_metric(c.metric) == nullptr)
      throw InputError(source + ": criteria: metric = \"" + c.metric +
                       "\" is not a metric (docs/results.md lists them)");
    if (!c.min && !c.max)
      throw InputError(source + ": criteria: metric = \"" + c.metric + "\" has neither min nor max");
  }
}

std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics) {
  check_criteria(criteria, "scenario");
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
