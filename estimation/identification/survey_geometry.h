// The arm's geometry as 22 numbers, and from them where the pins stand for given encoder readings: the formulas of
// machine/kinematics.cpp (triangle law, circle intersections), templated so that derivatives by every length are exact.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/kinematic_calibration.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// Where each starts in a geometry vector; pins are (x, z).
enum GeometryIndex {
  kLinkLength = 0,
  kBoomParent = 3,
  kBoomChild = 5,
  kArmParent = 7,
  kArmChild = 9,
  kCylinderPin = 11,
  kRockerPin = 13,
  kBucketPin = 15,
  kRockerLength = 17,
  kCouplerLength = 18,
  kEncoderOffset = 19,
  kGeometryCount = 22
};
using GeometryVector = Eigen::Matrix<double, kGeometryCount, 1>;
using GeometryMatrix = Eigen::Matrix<double, kGeometryCount, kGeometryCount>;
extern const std::array<const char*, kGeometryCount> kGeometryNames;

[[nodiscard]] GeometryVector geometry_of(const MachineDescription& machine);
[[nodiscard]] GeometryCalibration to_calibration(const GeometryVector& geometry);
/// The machine with this geometry in the place of its drawing's.
[[nodiscard]] MachineDescription with_geometry(const MachineDescription& machine, const GeometryVector& geometry);

/// Which of two mirrored solutions each linkage stands in; the same for the drawing and for all that is near it.
struct LinkageSides {
  double boom = 1, arm = 1;        ///< Sign of the cylinder's lever.
  double rocker = 1, coupler = 1;  ///< Side of H seen from G to J, of K seen from H to the bucket joint.
};
[[nodiscard]] LinkageSides sides_of(const MachineDescription& machine);

namespace detail {

template <typename T>
using Pin = Eigen::Matrix<T, 2, 1>;

template <typename T>
T cross(const Pin<T>& a, const Pin<T>& b) {
  return a.x() * b.y() - a.y() * b.x();
}

template <typename T>
bool triangle_angle(const Pin<T>& parent, const Pin<T>& child, const T& length, double side, T& angle) {
  const T cosine =
      (parent.squaredNorm() + child.squaredNorm() - length * length) / (2.0 * parent.norm() * child.norm());
  if (!(cosine > -1.0 && cosine < 1.0)) return false;
  using std::acos;
  using std::atan2;
  angle = side * acos(cosine) - atan2(child.y(), child.x()) + atan2(parent.y(), parent.x());
  return true;
}

template <typename T>
bool circles_meet(const Pin<T>& a, const T& radius_a, const Pin<T>& b, const T& radius_b, double side, Pin<T>& at) {
  const Pin<T> ray = b - a;
  const T distance2 = ray.squaredNorm();
  const T along = (distance2 + radius_a * radius_a - radius_b * radius_b) / (2.0 * distance2);
  const T across2 = radius_a * radius_a / distance2 - along * along;
  if (!(across2 > 0.0)) return false;
  using std::sqrt;
  const T across = side * sqrt(across2);
  at = {a.x() + along * ray.x() - across * ray.y(), a.y() + along * ray.y() + across * ray.x()};
  return true;
}

}  // namespace detail

/// Arm pin, bucket pin and tip in M for encoder readings.
/// @param geometry kGeometryCount values. @return false where a linkage cannot close.
template <typename T>
bool survey_points(const T* geometry, const JointVector& reading_m, const LinkageSides& sides,
                   std::array<detail::Pin<T>, kJoints>& points) {
  using detail::Pin;
  const auto pin = [&](int at) { return Pin<T>(geometry[at], geometry[at + 1]); };
  const auto length = [&](int joint) { return T(reading_m[joint]) - geometry[kEncoderOffset + joint]; };
  const Pin<T> arm_joint(geometry[kLinkLength + kBoom], T(0)), bucket_joint(geometry[kLinkLength + kArm], T(0));
  std::array<T, kJoints> angle;
  if (!detail::triangle_angle<T>(pin(kBoomParent), pin(kBoomChild), length(kBoom), sides.boom, angle[kBoom]) ||
      !detail::triangle_angle<T>(pin(kArmParent) - arm_joint, pin(kArmChild), length(kArm), sides.arm, angle[kArm])) {
    return false;
  }
  const Pin<T> bucket_pin = pin(kBucketPin);
  Pin<T> crank, driven;
  if (!detail::circles_meet<T>(pin(kCylinderPin), length(kBucket), pin(kRockerPin), geometry[kRockerLength],
                               sides.rocker, crank) ||
      !detail::circles_meet<T>(crank, geometry[kCouplerLength], bucket_joint, bucket_pin.norm(), sides.coupler,
                               driven)) {
    return false;
  }
  const Pin<T> arm_of_pin = driven - bucket_joint;
  using std::atan2;
  using std::cos;
  using std::sin;
  angle[kBucket] = atan2(detail::cross<T>(bucket_pin, arm_of_pin), bucket_pin.dot(arm_of_pin));
  T sum(0);
  Pin<T> at(T(0), T(0));
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    sum += angle[k];
    at += geometry[kLinkLength + i] * Pin<T>(cos(sum), sin(sum));
    points[k] = at;
  }
  return true;
}

// The least-squares problem behind kinematic calibration: surveyed points, their errors, and the drawing as prior.

/// One surveyed point: the end of link `link` in pose `pose`.
struct SurveyPoint {
  std::size_t pose = 0;
  int link = 0;
  JointVector reading_m;
  PlanarVector at_m;
  Eigen::Matrix2d whitening;  ///< Makes its error of unit covariance.
  bool used = true;
};

struct GeometryPrior {
  GeometryVector mean, sigma;
  LinkageSides sides;
};

[[nodiscard]] GeometryPrior geometry_prior(const MachineDescription& nominal);

/// Modelled minus surveyed [m]; nullopt where a linkage cannot close.
[[nodiscard]] std::optional<PlanarVector> point_error(const SurveyPoint& point, const GeometryVector& geometry,
                                                      const LinkageSides& sides);

/// Derivative of the whitened error by the geometry; zero where a linkage cannot close.
[[nodiscard]] Eigen::Matrix<double, 2, kGeometryCount> error_gradient(const SurveyPoint& point,
                                                                      const GeometryVector& geometry,
                                                                      const LinkageSides& sides);

/// Error of a point at the end of `link`: the surveyor's, and the encoders' seen through their levers.
[[nodiscard]] Eigen::Matrix2d whitening_of(const Kinematics& kinematics, const MachineDescription& machine,
                                           const JointVector& joints_rad, int link, double point_sigma_m);

/// @param robust large errors pull little (Cauchy), for finding outliers. @return nullopt where it does not converge.
[[nodiscard]] std::optional<GeometryVector> fit_geometry(const std::vector<SurveyPoint>& points,
                                                         const GeometryPrior& prior, bool robust);

}  // namespace knuckle::estimation
