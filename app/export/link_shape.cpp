#include "app/export/link_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::exporting {
namespace {

// Shares of the reach: what machines of this kind usually have.
constexpr double kBoomWidth = 0.052, kArmWidth = 0.038, kLinkHeight = 0.05, kLugHeight = 0.03;
constexpr double kBucketWidth = 0.15, kPlate = 0.008;

/// A uniform plate all the way along the outline from corner `first` to `last`.
void add_plates(Shape& shape, const std::array<PlanarVector, 6>& outline, std::size_t first, std::size_t last,
                double plate_m, double width_m, double aside_m) {
  for (std::size_t i = first; i < last; ++i) {
    shape.push_back({outline[i % outline.size()], outline[(i + 1) % outline.size()], plate_m, width_m, aside_m});
  }
}

/// Floor and back over the whole width; at the mouth, which is open, the rims of both side plates.
Shape bucket_shape(const MachineDescription& machine) {
  const double size = reach_m(machine), plate_m = kPlate * size, width_m = kBucketWidth * size;
  const std::array<PlanarVector, 6> outline = bucket_outline(machine);
  constexpr std::size_t kTip = 0, kBack = 3;
  Shape shape;
  add_plates(shape, outline, kTip, kBack, plate_m, width_m, 0);
  for (const double side : {-1.0, 1.0}) {
    add_plates(shape, outline, kBack, outline.size(), plate_m, plate_m, side * (width_m - plate_m) / 2);
  }
  return shape;
}

}  // namespace

Shape hull_shape(const MachineDescription& machine) {
  const double size = reach_m(machine), ground_m = ground_level_m(machine);
  const double track_m = -0.13 * size, deck_m = 0.03 * size;
  const auto block = [&](double rear, double front, double low_m, double high_m, double width, double aside) {
    const double middle_m = (low_m + high_m) / 2;
    return Bar{{rear * size, middle_m}, {front * size, middle_m}, high_m - low_m, width * size, aside * size};
  };
  return {block(-0.52, 0.1, ground_m, track_m, 0.08, -0.16), block(-0.52, 0.1, ground_m, track_m, 0.08, 0.16),
          block(-0.5, 0.09, track_m, deck_m, 0.36, 0)};
}

Shape link_shape(const MachineDescription& machine, int joint) {
  const double size = reach_m(machine), height_m = kLinkHeight * size, lug_m = kLugHeight * size;
  const PlanarVector origin = PlanarVector::Zero(), end(machine.links[static_cast<std::size_t>(joint)].length_m, 0);
  if (joint == kBoom) {  // bent where its cylinder holds it
    const PlanarVector bend = machine.boom_mount.child_pin_m;
    const double width_m = kBoomWidth * size;
    return {{origin, bend, height_m, width_m},
            {bend, end, height_m, width_m},
            {bend, machine.arm_mount.parent_pin_m, lug_m, width_m}};
  }
  if (joint == kArm) {
    const double width_m = kArmWidth * size;
    return {{origin, end, height_m, width_m},
            {origin, machine.arm_mount.child_pin_m, lug_m, width_m},
            {origin, machine.bucket_linkage.cylinder_pin_m, lug_m, width_m}};
  }
  return bucket_shape(machine);
}

Eigen::Vector3d size_m(const Shape& shape) {
  Eigen::AlignedBox3d box;
  for (const Bar& bar : shape) {
    const PlanarVector along = (bar.to_m - bar.from_m).stableNormalized();
    const PlanarVector across = PlanarVector(-along.y(), along.x()) * bar.height_m / 2;
    for (const PlanarVector& end : {bar.from_m, bar.to_m}) {
      for (const double side : {-1.0, 1.0}) {
        const PlanarVector corner = end + side * across;
        box.extend(Eigen::Vector3d(corner.x(), bar.aside_m - bar.width_m / 2, corner.y()));
        box.extend(Eigen::Vector3d(corner.x(), bar.aside_m + bar.width_m / 2, corner.y()));
      }
    }
  }
  return box.sizes();
}

}  // namespace knuckle::exporting
