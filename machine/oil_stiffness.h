// How stiffly oil holds a cylinder whose valve is shut.
#pragma once

#include <algorithm>

#include "machine/arm_description.h"

namespace knuckle {

/// Of both chambers and their hoses at this length, N/m.
[[nodiscard]] inline double oil_stiffness_N_per_m(const CylinderDescription& cylinder,
                                                  const HydraulicsDescription& hydraulics, double length_m) noexcept {
  const double head = cylinder.head_area_m2(), rod = cylinder.rod_side_area_m2();
  const double stroke = cylinder.max_length_m - cylinder.min_length_m;
  const double s = std::clamp(length_m - cylinder.min_length_m, 0.0, stroke);
  const double hose = hydraulics.hose_volume_m3;
  return hydraulics.bulk_modulus_Pa * (head * head / (hose + head * s) + rod * rod / (hose + rod * (stroke - s)));
}

}  // namespace knuckle
