// What a surveyor (total station, tape and plumb) measures of the standing machine: the points that link angles and
// lengths show in, beside what the wire encoders say.
#pragma once

#include <string>
#include <vector>

#include "core/joints.h"

namespace knuckle::estimation {

/// One pose at rest; frame M. A point that was not measured is NaN.
struct SurveyPose {
  JointVector cylinder_m = JointVector::Zero();      ///< Encoder readings.
  PlanarVector arm_pin_m = PlanarVector::Zero();     ///< Joint boom-arm.
  PlanarVector bucket_pin_m = PlanarVector::Zero();  ///< Joint arm-bucket.
  PlanarVector tip_m = PlanarVector::Zero();
};

struct Survey {
  std::string source;
  double point_sigma_m = 1e-3;  ///< Of one coordinate.
  std::vector<SurveyPose> poses;
};

}  // namespace knuckle::estimation
