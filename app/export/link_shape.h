// Boxes that a machine is drawn with where no meshes are: in the file of its model, and to choose what its links'
// inertia across the plane is.
#pragma once

#include <vector>

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::exporting {

/// A box along a line in the arm's plane, or beside it.
struct Bar {
  PlanarVector from_m, to_m;  ///< Axes of its link, or of M.
  double height_m = 0;        ///< In the plane, across the line.
  double width_m = 0;         ///< Across the plane.
  double aside_m = 0;         ///< Of its middle from the plane, along y.
};
using Shape = std::vector<Bar>;

/// Hull and tracks; of both, the description has the boom pin's place only.
[[nodiscard]] Shape hull_shape(const MachineDescription& machine);
/// Boom and arm: bars from pin to pin; bucket: plates along its outline, open at the mouth.
[[nodiscard]] Shape link_shape(const MachineDescription& machine, int joint);

/// Of the smallest box around all corners of a link's bars, along x, y and z of its axes; every number above 0.
[[nodiscard]] Eigen::Vector3d size_m(const Shape& shape);

}  // namespace knuckle::exporting
