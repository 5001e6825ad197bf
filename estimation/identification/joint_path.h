// A motion of the three joints to be driven: sampled at a fixed period.
#pragma once

#include <vector>

#include "core/joints.h"

namespace knuckle::estimation {

struct JointPath {
  double step_s = 0.005;
  std::vector<JointVector> joint_rad;
  [[nodiscard]] double duration_s() const noexcept { return step_s * static_cast<double>(joint_rad.size()); }
};

}  // namespace knuckle::estimation
