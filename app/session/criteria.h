// What a scenario asks of a session: bounds on metrics, what it means to miss one, and the verdict.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/metrics.h"

namespace knuckle::session {

enum class CriterionKind : std::uint8_t {
  kSafety,       ///< Must never happen: decides with every machine and seed.
  kCriterion,    ///< Of a user's own scenario: likewise.
  kRequirement,  ///< Must not get worse: decides for the stock set-up, and where it is asked to.
  kGoal          ///< Is worked towards: decides nothing.
};

/// One entry of a scenario. At least one bound is set.
struct Criterion {
  std::string metric;  ///< Name of a metric, as in metric_table().
  std::optional<double> min, max;
  CriterionKind kind = CriterionKind::kCriterion;
};

/// One bound checked. A metric the session could not measure fails its criterion.
struct CriterionResult {
  std::string name;
  std::optional<double> value;
  std::string unit;
  std::string relation;  ///< "max" or "min"
  double bound = 0;
  CriterionKind kind = CriterionKind::kCriterion;
  std::optional<bool> met;     ///< Null: the session was cut short before it could be judged.
  std::optional<double> at_s;  ///< When it was at its worst; null where there is no such moment, or it is 0.
  std::string phase;           ///< Of the operator, then.

  [[nodiscard]] bool missed() const noexcept { return met == false; }
};

/// Metrics that [[safety]] may name.
inline constexpr std::string_view kSafetyMetrics[] = {"command_neutral_ms", "spool_neutral_ms", "max_slew_N_per_ms",
                                                      "resumed_by_itself", "faults"};

/// One result per bound, in the order given.
/// @param criteria of metrics that find_metric knows.
/// @param record that the metrics were taken from. Where it was cut short, only a [[safety]] maximum that is exceeded
/// already is judged.
[[nodiscard]] std::vector<CriterionResult> evaluate(const std::vector<Criterion>& criteria, const Metrics& metrics,
                                                    const SessionRecord& record = {});

/// Whether one that is missed fails the session.
[[nodiscard]] bool decides(CriterionKind kind, bool requirements_decide) noexcept;
/// Whether none of those that decide is missed.
[[nodiscard]] bool all_passed(const std::vector<CriterionResult>& results, bool requirements_decide = true) noexcept;

}  // namespace knuckle::session
