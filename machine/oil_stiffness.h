// How stiffly oil holds a cylinder whose valve is shut, and what it gives way.
#pragma once

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "machine/kinematics.h"

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

/// By how much a joint stands behind what the oil let into its cylinder would make of it without a load; fades to 0
/// where its lever becomes too short to tell.
/// @param cylinder_N p_A A_A - p_B A_B
[[nodiscard]] inline double given_way_rad(const MachineDescription& machine, const Kinematics& kinematics, int joint,
                                          double angle_rad, double cylinder_N) noexcept {
  const auto at = kinematics.cylinder_at(joint, angle_rad);
  if (!at) return 0;
  const double sure = std::clamp((std::abs(at->lever_m) - kNearToggle_m) / kNearToggle_m, 0.0, 1.0);
  if (sure == 0) return 0;
  const auto& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
  return sure * cylinder_N / oil_stiffness_N_per_m(cylinder, machine.hydraulics, at->length_m) / at->lever_m;
}

}  // namespace knuckle
