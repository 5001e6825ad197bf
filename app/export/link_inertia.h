// The inertia of each link in space, from the model of motion in the plane.
//
// Motion in the plane shows nine numbers only: J_i, X_i, Z_i (estimation/regressor.h). Three bodies in space have
// thirty. The other 21 are chosen; no torque or motion in the plane depends on them:
//   3  masses m_i. The drawing's, with what hangs on each link; where no steel of these masses has the nine as they
//   were
//      identified, the nearest masses of which some has. With M_i the masses beyond link i and l_i its length,
//        x_i = (X_i - l_i M_i) / m_i,  z_i = Z_i / m_i,  I_i = J_i - l_i^2 M_i - m_i (x_i^2 + z_i^2).
//   9  y of the centres of mass, and the products I_xy and I_yz: 0, as the links are alike on both sides of the plane.
//   9  I_xx, I_zz and I_xz. A uniform box as large as the link is drawn has second moments of mass S_x, S_y, S_z
//      (S_a = integral of a^2 dm) about its centre; S_x and S_z are scaled alike until S_x + S_z = I_i, S_xz = 0. Then
//        I_xx = S_y + S_z,  I_yy = S_x + S_z,  I_zz = S_x + S_y,  I_xz = 0.
// With m_i > 0 and all S > 0 the pseudo-inertia diag(S_x, S_y, S_z, m) is positive definite: some distribution of steel
// has it. That implies a positive definite tensor and the triangle inequality of its moments.
#pragma once

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::exporting {

/// About the centre of mass, in axes parallel to the link's: x along the link, z to its left, y into the plane.
struct LinkInertia {
  double mass_kg = 0;
  PlanarVector com_m = PlanarVector::Zero();  ///< x and z in link axes.
  Eigen::Vector3d moment_kgm2 = {0, 0, 0};    ///< I_xx, I_yy, I_zz; the products are 0.
};

/// Of a uniform box around the link: along x, y and z of its axes.
using LinkSize = Eigen::Vector3d;

/// @param machine as calibrated() gives it. @param size_m of the links as drawn; every number above 0.
/// @return links of which estimation::known_parameters(machine) are the nine numbers.
/// @throws InputError where no masses from half to twice the drawing's make links of steel with these parameters.
[[nodiscard]] PerJoint<LinkInertia> link_inertias(const MachineDescription& machine, const PerJoint<LinkSize>& size_m);

}  // namespace knuckle::exporting
