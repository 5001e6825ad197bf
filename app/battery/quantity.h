// From what the cells of a battery measured to one figure of its table.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "app/battery/rows.h"
#include "core/joints.h"

namespace knuckle::battery {

// What was measured, by name, as rows keep it: a number, a list, or null for no number.
[[nodiscard]] inline Row metric(double value) {
  return std::isfinite(value) ? Row(value) : Row();
}
[[nodiscard]] inline Row metric(const std::vector<double>& values) {
  Row list = Row::array();
  for (const double value : values) list.push_back(metric(value));
  return list;
}
/// One metric for each joint: NAME.boom, NAME.arm, NAME.bucket.
inline void add_joints(Row& metrics, const std::string& name, const JointVector& values) {
  for (std::size_t i = 0; i < kJoints; ++i)
    metrics[name + "." + kJointNames[i]] = metric(values[static_cast<Eigen::Index>(i)]);
}

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// How the values of all cells make one.
enum class By : std::uint8_t {
  kMedian,
  kP90,
  kP95,
  kWorst,
  kShare,  ///< Of values that are 0 or 1.
  kRatio,  ///< Of metrics [part, whole]: all parts over all wholes.
  kRms,    ///< Relative to `whole`.
};

[[nodiscard]] const char* name(By by) noexcept;

struct Quantity {
  std::string name, metric;
  By by = By::kMedian;
  std::string unit;
  double scale = 1;
  double low = -kNever, high = kNever;                        ///< Of the target; without bounds it is only stated.
  double missing = std::numeric_limits<double>::quiet_NaN();  ///< A value that is null counts as this.
  double whole = 1;
  bool asked = false;  ///< Where a target is, having no value at all misses it; else there is no such row.

  /// "<= 30", ">= 0.97", "0.9 to 0.99"; empty: stated only.
  [[nodiscard]] std::string target() const;
};

/// Metrics of the cells that have any.
using Sources = std::vector<const Row*>;

/// Of a list every element.
[[nodiscard]] std::vector<double> values_of(const Quantity& quantity, const Sources& sources);
/// NaN where there is none.
[[nodiscard]] double value_of(const Quantity& quantity, const Sources& sources);

}  // namespace knuckle::battery
