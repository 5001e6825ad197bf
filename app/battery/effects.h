// What a sampled machine is like in figures, one for each rough effect, and which of them a metric goes with.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/battery/rows.h"
#include "sim/truth.h"

namespace knuckle::battery {

/// Name in sim/README.md's words -> mean over the joints, or the value itself.
[[nodiscard]] nlohmann::ordered_json effects_of(const sim::MachineTruth& truth);

/// Spearman's rank correlation of an effect with a metric over the sessions that have both.
struct Sensitivity {
  std::string effect, metric;
  double correlation = 0;  ///< -1 to 1
  std::uint64_t of = 0;
  /// Whether it is larger than chance makes one of a hundred correlations.
  [[nodiscard]] bool is_plain() const noexcept;
};
/// Of some metrics of feeling, force and tracking, the largest correlation first; none where machines do not differ by
/// an effect.
[[nodiscard]] std::vector<Sensitivity> sensitivities(const Rows& rows);

}  // namespace knuckle::battery
