// The arm's true lengths and pins from a survey of the standing machine. The drawing is the prior: what the survey
// cannot tell apart stays as drawn.
#pragma once

#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

// What a surveyor (total station, tape and plumb) measures of the standing machine: the points that link angles and
// lengths show in, beside what the wire encoders say.

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

/// Standard deviations of the machine around its drawing. +-2 mm evenly spread is 1.2 mm, +-0.5 mm is 0.3 mm.
inline constexpr double kPinSigma_m = 1.2e-3;  ///< One coordinate of a pin; a link's length.
inline constexpr double kRodSigma_m = 0.3e-3;  ///< Rocker and coupler.
inline constexpr double kEncoderOffsetSigma_m = 0.3e-3;
inline constexpr std::size_t kLeastPoses = 8;

/// Distance of a surveyed tip from the one that the encoder readings give. Contains the surveyor's own error.
struct TipError {
  std::size_t poses = 0;
  double rms_m = 0, median_m = 0, p95_m = 0;
};

struct GeometryResult {
  Identification summary;        ///< Parameters in mm; where not usable the geometry is the drawing's.
  GeometryCalibration geometry;  ///< tip_rms_m is that of held_out.
  TipError held_out, nominal;    ///< Of the same poses.
  double residual_ratio = 0;  ///< RMS of weighted residuals per degree of freedom; 1 where the survey's sigma is true.
  std::vector<std::string> left_out;  ///< "pose 7: tip is 0.213 m off"
};

/// Weighted least squares (Ceres) on arm pin, bucket pin and tip, as far as measured, with the drawing as prior; a
/// point more than five standard deviations off is left out and named. Errors of a point: the survey's sigma and the
/// encoders' step seen through their levers. The covariance is the linearised one, widened where residuals are.
/// Too few or too similar poses, or points that cannot be this machine's (wrong unit, mirrored, swapped), make it
/// `usable == false` with the reason.
/// @param nominal its encoder offsets, too, are the prior's middle; its geometry calibration is not looked at.
/// @throws InputError where the drawing itself is no machine.
[[nodiscard]] GeometryResult calibrate_geometry(const MachineDescription& nominal, const Survey& survey);

/// Poses [rad] to survey, in an order of short ways: each adds most to what the poses before it tell of the geometry
/// (D-optimal, greedy, out of an evenly spread choice), inside soft margins and virtual walls.
[[nodiscard]] std::vector<JointVector> survey_poses(const MachineDescription& machine, std::size_t count);

}  // namespace knuckle::estimation
