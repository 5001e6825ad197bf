// What commissioning has found out about one particular machine, beside what its drawing says: plain data, SI units.
// `knuckle identify` writes it into the machine file's [calibration]; controller and estimator then use it instead of
// the nominal values. The simulator never reads it.
#pragma once

#include <string>

#include "core/joints.h"

namespace knuckle {

/// Friction of one cylinder at the rod, F_f(v) on a Dahl state s in [-1, 1]; v > 0 extends:
///   F_f = F_o + (F_c + F_b exp(-(v/v_s)^2) + k |p_A A_A - p_B A_B| + a (p_A + p_B)) s + F_v v,
/// F_c the mean of both directions' and F_o half their difference: at s = +-1 that is each direction's own. What makes
/// them differ is mostly the pressure transmitters' offset, which is there at s = 0, too.
struct FrictionCalibration {
  double coulomb_extend_N = 0, coulomb_retract_N = 0;  ///< F_c + F_o, F_c - F_o
  double viscous_Ns_per_m = 0;                         ///< F_v, with the oil of the day of the recording.
  double breakaway_N = 0;                              ///< F_b = F_s - F_c
  double stribeck_mps = 0.012;                         ///< v_s
  double load_share = 0;                               ///< k, of what pins carry
  double seal_m2 = 0;                                  ///< a, of seals that pressure holds against the bore
};

/// Order of Calibration::parameters and of its covariance: nine base parameters J1 J2 J3 X1 X2 X3 Z1 Z2 Z3
/// (estimation/regressor.h), then six of friction a cylinder.
inline constexpr int kBaseCount = 9;
inline constexpr int kFrictionCount = 6;
enum FrictionIndex { kCoulombExtend, kCoulombRetract, kViscous, kBreakaway, kLoadShare, kSeal };
inline constexpr int kCalibrationCount = kBaseCount + kFrictionCount * kJoints;
[[nodiscard]] constexpr int friction_index(int joint, FrictionIndex which) noexcept {
  return kBaseCount + kFrictionCount * joint + which;
}
using CalibrationVector = Eigen::Matrix<double, kCalibrationCount, 1>;
using CalibrationMatrix = Eigen::Matrix<double, kCalibrationCount, kCalibrationCount>;

/// Torques of the machine as identified.
struct DynamicsCalibration {
  CalibrationVector parameters = CalibrationVector::Zero();
  CalibrationMatrix covariance = CalibrationMatrix::Zero();  ///< Model error included.
  JointVector stribeck_mps = JointVector::Constant(0.012);   ///< v_s: not linear, hence not among the parameters.
  JointVector residual_rms_Nm = JointVector::Zero();         ///< Joint torque left over on held-out motion, to 2 Hz.

  [[nodiscard]] Eigen::Matrix<double, kBaseCount, 1> base() const noexcept { return parameters.head<kBaseCount>(); }
  [[nodiscard]] FrictionCalibration friction(int joint) const noexcept {
    const auto at = [&](FrictionIndex which) { return parameters[friction_index(joint, which)]; };
    return {at(kCoulombExtend),  at(kCoulombRetract), at(kViscous), at(kBreakaway),
            stribeck_mps[joint], at(kLoadShare),      at(kSeal)};
  }
};

/// Lengths and pins as measured; they replace the drawing's. Only what changes angles, levers and the tip.
struct GeometryCalibration {
  JointVector length_m = JointVector::Zero();
  PlanarVector boom_parent_pin_m = PlanarVector::Zero(), boom_child_pin_m = PlanarVector::Zero();
  PlanarVector arm_parent_pin_m = PlanarVector::Zero(), arm_child_pin_m = PlanarVector::Zero();
  PlanarVector cylinder_pin_m = PlanarVector::Zero(), rocker_pin_m = PlanarVector::Zero(),
               bucket_pin_m = PlanarVector::Zero();
  double rocker_length_m = 0, coupler_length_m = 0;
  JointVector encoder_offset_m = JointVector::Zero();  ///< Reading minus true pin-to-pin length.
  double tip_rms_m = 0;                                ///< Of held-out poses.
};

/// One axis of valve and cylinder.
struct ValveCalibration {
  double dead_band_extend = 0, dead_band_retract = 0;  ///< Fraction of spool stroke.
  double delay_s = 0;                                  ///< Command to first motion.
  double nominal_flow_m3ps = 0;                        ///< At the drop of the machine file.
  double curve_exponent = 1, retract_share = 1;        ///< As in ValveDescription.
  double notch_opening = 0, notch_slope = 1;           ///< Likewise.
  /// As a drawing's are, and alike.
  [[nodiscard]] bool straight() const noexcept {
    return curve_exponent == 1 && (notch_opening == 0 || notch_slope == 1);
  }
};

/// Where it came from.
struct CalibrationProvenance {
  std::string method;  ///< "full", "kim", ...
  std::string date;    ///< ISO 8601, UTC
  std::string data_sha256, data_source;
  std::string program;  ///< "knuckle 0.1.0"
};

}  // namespace knuckle
