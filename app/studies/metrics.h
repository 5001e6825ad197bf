// What was measured, by name, as the rows of a battery keep it: a number, a list, or null for no number.
#pragma once

#include <cmath>
#include <vector>

#include "app/battery/rows.h"
#include "core/joints.h"

namespace knuckle::studies {

using battery::Row;

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

}  // namespace knuckle::studies
