// Parameters that some arm of steel could have: the pseudo-inertia of each link, carrying the later links at its end,
//   [[J, X, Z], [X, M, 0], [Z, 0, M]] >= 0   <=>   J M >= X^2 + Z^2,  M > 0,  M = sum of m_k for k >= i,
// with M no more than the machine file's masses allow, and no cylinder whose viscosity, Coulomb friction (the mean of
// both directions: half their difference is a transmitter's error) or static friction drives it.
#pragma once

#include "core/joints.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

/// Greatest M_i: links, cylinders and linkage from joint i on, a quarter more than the machine file says.
[[nodiscard]] JointVector greatest_mass_kg(const MachineDescription& machine);

[[nodiscard]] bool physically_consistent(const CalibrationVector& parameters, const JointVector& greatest_kg) noexcept;

/// The consistent parameters p nearest to `free` in the metric of the data, (p - free)^T information (p - free).
/// Parameters without any information stay as they are. Ceres on J = (X^2 + Z^2) / M + d^2 and the like.
[[nodiscard]] CalibrationVector nearest_consistent(const CalibrationVector& free, const CalibrationMatrix& information,
                                                   const JointVector& greatest_kg);

}  // namespace knuckle::estimation
