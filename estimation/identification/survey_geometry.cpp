#include "estimation/identification/survey_geometry.h"

#include <Eigen/Geometry>

#include "machine/description.h"

namespace knuckle::estimation {

const std::array<const char*, kGeometryCount> kGeometryNames{
    "boom length",           "arm length",           "bucket length",    "boom parent pin x",
    "boom parent pin z",     "boom child pin x",     "boom child pin z", "arm parent pin x",
    "arm parent pin z",      "arm child pin x",      "arm child pin z",  "bucket cylinder pin x",
    "bucket cylinder pin z", "rocker pin x",         "rocker pin z",     "bucket pin x",
    "bucket pin z",          "rocker length",        "coupler length",   "boom encoder offset",
    "arm encoder offset",    "bucket encoder offset"};

GeometryVector geometry_of(const MachineDescription& m) {
  GeometryVector g;
  const BucketLinkage& linkage = m.bucket_linkage;
  g << m.links[kBoom].length_m, m.links[kArm].length_m, m.links[kBucket].length_m, m.boom_mount.parent_pin_m,
      m.boom_mount.child_pin_m, m.arm_mount.parent_pin_m, m.arm_mount.child_pin_m, linkage.cylinder_pin_m,
      linkage.rocker_pin_m, linkage.bucket_pin_m, linkage.rocker_length_m, linkage.coupler_length_m,
      m.sensors.encoder_offset_m;
  return g;
}

GeometryCalibration to_calibration(const GeometryVector& g) {
  GeometryCalibration c;
  c.length_m = g.segment<3>(kLinkLength);
  c.boom_parent_pin_m = g.segment<2>(kBoomParent);
  c.boom_child_pin_m = g.segment<2>(kBoomChild);
  c.arm_parent_pin_m = g.segment<2>(kArmParent);
  c.arm_child_pin_m = g.segment<2>(kArmChild);
  c.cylinder_pin_m = g.segment<2>(kCylinderPin);
  c.rocker_pin_m = g.segment<2>(kRockerPin);
  c.bucket_pin_m = g.segment<2>(kBucketPin);
  c.rocker_length_m = g[kRockerLength];
  c.coupler_length_m = g[kCouplerLength];
  c.encoder_offset_m = g.segment<3>(kEncoderOffset);
  return c;
}

MachineDescription with_geometry(const MachineDescription& machine, const GeometryVector& geometry) {
  MachineDescription changed = machine;
  changed.valve_calibration = {};
  changed.geometry_calibration = to_calibration(geometry);
  return calibrated(changed);
}

LinkageSides sides_of(const MachineDescription& machine) {
  const Kinematics kinematics(machine);
  const auto middle = [&](std::size_t i) { return 0.5 * (machine.links[i].min_rad + machine.links[i].max_rad); };
  const auto side = [](double value) { return value > 0 ? 1.0 : -1.0; };
  LinkageSides sides;
  sides.boom = side(kinematics.cylinder_at(kBoom, middle(kBoom)).value().lever_m);
  sides.arm = side(kinematics.cylinder_at(kArm, middle(kArm)).value().lever_m);
  // H on the bucket side is where both circles meet; its side of G-J and K's side of H-joint tell the branch.
  const BucketLinkage& linkage = machine.bucket_linkage;
  const PlanarVector joint(machine.links[kArm].length_m, 0);
  const PlanarVector pin = joint + Eigen::Rotation2Dd(middle(kBucket)) * linkage.bucket_pin_m;
  PlanarVector crank;
  detail::circles_meet<double>(linkage.rocker_pin_m, linkage.rocker_length_m, pin, linkage.coupler_length_m,
                               linkage.branch > 0 ? 1.0 : -1.0, crank);
  sides.rocker =
      side(detail::cross<double>(linkage.rocker_pin_m - linkage.cylinder_pin_m, crank - linkage.cylinder_pin_m));
  sides.coupler = side(detail::cross<double>(joint - crank, pin - crank));
  return sides;
}

}  // namespace knuckle::estimation
