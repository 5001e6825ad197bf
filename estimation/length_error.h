// How wrong lengths of cylinders are, and levers with them.
#pragma once

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// Standard deviation of a cylinder's length and lever together. Drawings: +-2 mm in x and z at both ends make 1.6 mm
/// of the length at a known angle, and as much of the lever; surveyed pins are known to some 0.2 mm.
inline constexpr double kNominalLength_m = 2.3e-3, kCalibratedLength_m = 0.35e-3;

// How far a joint is from the steel at an end of its way, and how far off that steel may be.

/// Along the rod: to the end of its stroke, or to where the working range of its joint ends, where the linkage has
/// steel of its own. Negative beyond it.
[[nodiscard]] inline double to_steel_m(const LinkDescription& link, const CylinderDescription& cylinder,
                                       const CylinderState& at, double joint_rad) noexcept {
  const double to_stroke_m = std::min(at.length_m - cylinder.min_length_m, cylinder.max_length_m - at.length_m);
  const double within_rad = std::min(joint_rad - link.min_rad, link.max_rad - joint_rad);
  return std::min(to_stroke_m, std::abs(at.lever_m) * within_rad);
}

/// Steel is met as much earlier or later as pins and encoder are wrong, which near a toggle is many degrees.
/// @param pins_calibrated whether the geometry was identified.
[[nodiscard]] constexpr double steel_spread_m(bool pins_calibrated) noexcept {
  constexpr double kSigmas = 3;
  return kSigmas * (pins_calibrated ? kCalibratedLength_m : kNominalLength_m);
}

}  // namespace knuckle::estimation
