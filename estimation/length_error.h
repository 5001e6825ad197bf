// How wrong lengths of cylinders are, and levers with them.
#pragma once

namespace knuckle::estimation {

/// Standard deviation of a cylinder's length and lever together. Drawings: +-2 mm in x and z at both ends make 1.6 mm
/// of the length at a known angle, and as much of the lever; surveyed pins are known to some 0.2 mm.
inline constexpr double kNominalLength_m = 2.3e-3, kCalibratedLength_m = 0.35e-3;

}  // namespace knuckle::estimation
