#include "app/session/criteria.h"

#include <algorithm>

#include "app/session/record_windows.h"

namespace knuckle::session {

std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics,
                                      const SessionRecord& record) {
  std::vector<CriterionResult> results;
  for (const Criterion& c : criteria) {
    const MetricEntry& entry = *find_metric(c.metric);
    const Metric& value = metrics.*entry.member;
    CriterionResult result{c.metric, value, std::string(entry.unit), "", 0, c.kind, {}, {}, ""};
    const auto add = [&](const char* relation, double bound, bool met, bool exceeded) {
      result.relation = relation;
      result.bound = bound;
      result.met = met;
      // What is too small has no moment: that of the largest value says nothing of it.
      if (value && *value != 0 && value.at_s && result.relation == "max") {
        result.at_s = value.at_s;
        result.phase = phase_at(record, *value.at_s);
      }
      if (record.cut_short && !(exceeded && c.kind == CriterionKind::kSafety)) result.met.reset();
      results.push_back(result);
    };
    // Written so that a NaN fails.
    const bool reaches = value && *value >= c.min.value_or(0), keeps = value && *value <= c.max.value_or(0);
    if (c.min) add("min", *c.min, reaches, false);
    if (c.max) add("max", *c.max, keeps, value.has_value() && !keeps);
  }
  return results;
}

bool decides(CriterionKind kind, bool requirements_decide) noexcept {
  return kind == CriterionKind::kRequirement ? requirements_decide : kind != CriterionKind::kGoal;
}

bool all_passed(const std::vector<CriterionResult>& results, bool requirements_decide) noexcept {
  return std::none_of(results.begin(), results.end(), [requirements_decide](const CriterionResult& r) {
    return r.missed() && decides(r.kind, requirements_decide);
  });
}

}  // namespace knuckle::session
