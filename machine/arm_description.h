// The arm and its hydraulics as the machine file says: plain data in SI units, no behaviour.
//
// Frames: M machine base, origin at the boom pin, x forward in the arm's plane, z up. Link i has its origin at its
// joint, x along the link to the next joint (bucket: to the tip), z to the left of x. Angles counter-clockwise seen
// with x right and z up; theta_boom from M's x, theta_arm and theta_bucket relative to the previous link.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/joints.h"

namespace knuckle {

struct LinkDescription {
  double length_m = 0;
  double mass_kg = 0;
  PlanarVector com_m = PlanarVector::Zero();  ///< Centre of mass in link axes.
  double inertia_kgm2 = 0;                    ///< About the centre of mass.
  double min_rad = 0, max_rad = 0;            ///< Working range of the joint.
  double max_rate_radps = 0;                  ///< Commanded speed limit.
};

/// Boom and arm: a cylinder between a pin on the parent link and a pin on the moved link.
struct TriangleMount {
  PlanarVector parent_pin_m = PlanarVector::Zero();  ///< In parent axes (boom: M).
  PlanarVector child_pin_m = PlanarVector::Zero();   ///< In the moved link's axes.
};

/// Bucket: cylinder from G on the arm to H; rocker J-H on the arm; coupler H-K to the bucket.
struct BucketLinkage {
  PlanarVector cylinder_pin_m = PlanarVector::Zero();  ///< G, arm axes.
  PlanarVector rocker_pin_m = PlanarVector::Zero();    ///< J, arm axes.
  PlanarVector bucket_pin_m = PlanarVector::Zero();    ///< K, bucket axes.
  double rocker_length_m = 0;                          ///< |HJ|
  double coupler_length_m = 0;                         ///< |HK|
  int branch = 1;                                      ///< +1: H to the left of the ray from J to K, -1: to its right.
  double rocker_mass_kg = 0, coupler_mass_kg = 0;
};

/// The bucket seen from the side, bucket axes: with the tip at (length, 0) and the bucket pin at the origin the corners
/// of a convex outline, counter-clockwise in this order.
struct BucketProfile {
  PlanarVector edge_m = PlanarVector::Zero();   ///< Teeth line: where the teeth's back meets the floor.
  PlanarVector heel_m = PlanarVector::Zero();   ///< Where the floor turns up.
  PlanarVector back_m = PlanarVector::Zero();   ///< Where the back ends, behind the linkage's pin.
  PlanarVector cheek_m = PlanarVector::Zero();  ///< Side plates, on the mouth's side.
};

struct FrictionDescription {
  double coulomb_N = 0;         ///< F_c
  double static_ratio = 1;      ///< F_s / F_c
  double stribeck_mps = 0.01;   ///< v_s
  double viscous_Ns_per_m = 0;  ///< F_v
};

/// Flow over one edge: nominal_flow sqrt(drop / nominal_drop) share, share = area^curve_exponent, times
/// retract_share where it retracts. With x the opening beyond the dead band, [0, 1], and x_n = notch_opening:
///   area = notch_slope x up to x_n (the metering notch), then straight from there to 1 at x = 1.
struct ValveDescription {
  double nominal_flow_m3ps = 0;  ///< At full opening and nominal_drop_Pa over one metering edge.
  double nominal_drop_Pa = 0;
  double dead_band_extend = 0, dead_band_retract = 0;  ///< Fraction of spool stroke.
  double hysteresis = 0;                               ///< Fraction of spool stroke.
  double delay_s = 0;
  double natural_frequency_Hz = 0;
  double damping_ratio = 0;
  double full_stroke_s = 0;  ///< Fastest centre-to-end time of the spool.
  // Identified; a drawing's edges are straight and alike.
  double curve_exponent = 1, retract_share = 1;
  double notch_opening = 0, notch_slope = 1;

  [[nodiscard]] double dead_band(bool extends) const noexcept { return extends ? dead_band_extend : dead_band_retract; }
  /// Of the edge, [0, 1], at a spool position of either sign.
  [[nodiscard]] double opening(double spool) const noexcept {
    const double band = dead_band(spool > 0);
    return std::clamp((std::abs(spool) - band) / (1 - band), 0.0, 1.0);
  }
  [[nodiscard]] double flow_share(double opening, bool extends) const noexcept {
    const double notch_area = notch_slope * notch_opening;
    const double area = opening < notch_opening
                            ? notch_slope * opening
                            : notch_area + (1 - notch_area) * (opening - notch_opening) / (1 - notch_opening);
    return (extends ? 1 : retract_share) * (curve_exponent == 1 ? area : std::pow(area, curve_exponent));
  }
  /// Inverse of flow_share(); straight through zero where it would be infinitely steep there.
  [[nodiscard]] double opening_for(double share, bool extends) const noexcept {
    constexpr double kStraight = 0.02;
    const double alike = std::clamp(share / (extends ? 1 : retract_share), 0.0, 1.0);
    const double root = 1 / curve_exponent;
    const double area = curve_exponent == 1                       ? alike
                        : curve_exponent > 1 && alike < kStraight ? alike / kStraight * std::pow(kStraight, root)
                                                                  : std::pow(alike, root);
    const double notch_area = notch_slope * notch_opening;
    if (area < notch_area) return area / notch_slope;
    return notch_opening + (area - notch_area) / (1 - notch_area) * (1 - notch_opening);
  }
};

struct CylinderDescription {
  double bore_m = 0, rod_m = 0;
  double min_length_m = 0, max_length_m = 0;  ///< Pin to pin, retracted and extended.
  double body_mass_kg = 0, rod_mass_kg = 0;
  FrictionDescription friction;
  ValveDescription valve;
  [[nodiscard]] double head_area_m2() const noexcept { return std::numbers::pi / 4 * bore_m * bore_m; }
  [[nodiscard]] double rod_side_area_m2() const noexcept {
    return std::numbers::pi / 4 * (bore_m * bore_m - rod_m * rod_m);
  }
};

struct HydraulicsDescription {
  double pump_flow_m3ps = 0;
  double pump_power_W = 0;
  double load_sensing_margin_Pa = 0;
  double load_sensing_lag_s = 0;
  double main_relief_Pa = 0, port_relief_Pa = 0, tank_Pa = 0;
  double bulk_modulus_Pa = 0;
  double hose_volume_m3 = 0;         ///< Per line.
  double hose_drop_Pa_per_m3ps = 0;  ///< Between transmitter and chamber.
};

struct SensorDescription {
  double pressure_range_Pa = 0, pressure_step_Pa = 0, pressure_noise_Pa = 0;
  double encoder_step_m = 0;
  double tilt_step_rad = 0, tilt_noise_rad = 0;
  enum class TiltMount : std::uint8_t { kOnHull, kOnBoom } tilt_mount = TiltMount::kOnHull;
  JointVector encoder_offset_m = JointVector::Zero();  ///< Reading minus true length, as calibrated.
  /// The one joint whose cylinder has no pressure transmitters, or kNone.
  static constexpr int kNone = -1;
  int without_pressures = kNone;
};

}  // namespace knuckle
