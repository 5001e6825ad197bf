// A camera that is mounted on the machine, as `[[camera]]` of its file says: where its lens is and what it looks at.
#pragma once

#include <Eigen/Core>
#include <string>

namespace knuckle {

/// Fixed to the machine's base, without lens distortion, its horizon level.
struct CameraDescription {
  std::string name;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Of the lens, frame M with y to the left.
  double pan_rad = 0;                                    ///< Positive: to the left of straight ahead.
  double tilt_rad = 0;                                   ///< Positive: above the horizon.
  double field_of_view_rad = 1;                          ///< Across the width of its picture.
};

}  // namespace knuckle
