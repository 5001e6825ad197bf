// The least-squares problem behind kinematic calibration: surveyed points, their errors, and the drawing as prior.
#pragma once

#include <optional>
#include <vector>

#include "estimation/identification/kinematic_calibration.h"
#include "estimation/identification/survey_geometry.h"

namespace knuckle::estimation {

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

[[nodiscard]] GeometryPrior geometry_prior(const MachineDescription& nominal, const GeometryOptions& options);

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
