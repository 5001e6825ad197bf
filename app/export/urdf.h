// The machine's model as URDF: links, joints, inertias, shapes without meshes.
//
// Links: base (frame M, origin at the boom pin, x forward, z up, y to the left), boom, arm, bucket, each with the axes
// of its description (x along the link, z to its left), and tip, a frame at the bucket's tip. Joints boom_joint,
// arm_joint and bucket_joint turn about -y, which is counter-clockwise seen with x right and z up; at angle zero all
// axes are parallel to M's. Their limits: range and speed of the machine file, and as effort the greatest torque that
// the cylinder has anywhere in the range at the main relief's pressure.
//
// What the model is: the rigid arm of the force estimate (estimation/regressor.h), so gravity torques and mass matrix
// are those that Knuckle itself computes with. Cylinders and linkage count as point masses at their pins; there are no
// closed chains, no friction, and no mass of the hull in it. Inertias: app/export/urdf.cpp.
#pragma once

#include <ostream>

#include "machine/description_fwd.h"

namespace knuckle::exporting {

/// @param machine as it was read; what was calibrated replaces the drawing, and a comment of the file says which.
/// @throws InputError as link_inertias() does.
void write_urdf(const MachineDescription& machine, std::ostream& out);

}  // namespace knuckle::exporting
