#include "app/export/urdf.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "app/cli/command.h"
#include "app/export/link_inertia.h"
#include "app/export/link_shape.h"
#include "app/report/html.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::exporting {
namespace {

/// Inside a comment, which "--" would end.
std::string remark(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) text.replace(at, 2, "- -");
  return text;
}

std::string origin_of_model(const MachineDescription& machine) {
  const char* geometry = machine.geometry_calibration ? "lengths as calibrated" : "lengths of the drawing";
  if (!machine.dynamics_calibration)
    return std::string("masses, centres of mass and inertias of the drawing, cylinders and linkage as point masses; ") +
           geometry + "; not identified on the machine";
  std::string from = "inertias and moments of mass as identified on the machine; ";
  if (const auto& by = machine.calibration_provenance) {
    from += fmt::format("method {}, {}, by {}, from {} (SHA-256 {}); ", by->method, by->date, by->program,
                        by->data_source, by->data_sha256);
  }
  return from + geometry;
}

void write_shape(std::ostream& out, const Shape& shape, const char* material) {
  for (const Bar& bar : shape) {
    const PlanarVector line = bar.to_m - bar.from_m, middle = (bar.from_m + bar.to_m) / 2;
    // A turn from x to z is one about -y.
    fmt::print(out,
               "    <visual>\n      <origin xyz=\"{:.6g} {:.6g} {:.6g}\" rpy=\"0 {:.6g} 0\"/>\n"
               "      <geometry><box size=\"{:.6g} {:.6g} {:.6g}\"/></geometry>\n      <material name=\"{}\"/>\n    "
               "</visual>\n",
               middle.x(), bar.aside_m, middle.y(), 0 - std::atan2(line.y(), line.x()), line.norm(), bar.width_m,
               bar.height_m, material);
  }
}

void write_link(std::ostream& out, const char* name, const LinkInertia& inertia, const Shape& shape) {
  const Eigen::Vector3d& moment = inertia.moment_kgm2;
  fmt::print(out,
             "  <link name=\"{}\">\n    <inertial>\n      <origin xyz=\"{} 0 {}\"/>\n      <mass value=\"{}\"/>\n"
             "      <inertia ixx=\"{}\" ixy=\"0\" ixz=\"0\" iyy=\"{}\" iyz=\"0\" izz=\"{}\"/>\n    </inertial>\n",
             name, inertia.com_m.x(), inertia.com_m.y(), inertia.mass_kg, moment.x(), moment.y(), moment.z());
  write_shape(out, shape, "paint");
  out << "  </link>\n";
}

/// Of the cylinder at the main relief's pressure on its head side, at the best lever in the joint's range.
double greatest_torque_Nm(const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  constexpr int kAngles = 200;
  const auto k = static_cast<std::size_t>(joint);
  const LinkDescription& link = machine.links[k];
  double lever_m = 0;
  for (int i = 0; i <= kAngles; ++i) {
    const auto cylinder = kinematics.cylinder_at(joint, link.min_rad + (link.max_rad - link.min_rad) * i / kAngles);
    if (cylinder) lever_m = std::max(lever_m, std::abs(cylinder->lever_m));
  }
  return lever_m * machine.hydraulics.main_relief_Pa * machine.cylinders[k].head_area_m2();
}

void write_joint(std::ostream& out, const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  const auto k = static_cast<std::size_t>(joint);
  const LinkDescription& link = machine.links[k];
  const bool first = joint == kBoom;
  fmt::print(out,
             "  <joint name=\"{0}_joint\" type=\"revolute\">\n    <parent link=\"{1}\"/>\n    <child link=\"{0}\"/>\n"
             "    <origin xyz=\"{2} 0 0\"/>\n    <axis xyz=\"0 -1 0\"/>\n"
             "    <limit lower=\"{3}\" upper=\"{4}\" velocity=\"{5}\" effort=\"{6:.0f}\"/>\n  </joint>\n",
             kJointNames[k], first ? "base" : kJointNames[k - 1], first ? 0 : machine.links[k - 1].length_m,
             link.min_rad, link.max_rad, link.max_rate_radps, greatest_torque_Nm(machine, kinematics, joint));
}

}  // namespace

void write_urdf(const MachineDescription& read, std::ostream& out) {
  const MachineDescription machine = calibrated(read);
  const Kinematics kinematics(machine);
  PerJoint<Shape> shapes;
  PerJoint<LinkSize> sizes_m;
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    shapes[k] = link_shape(machine, i);
    sizes_m[k] = size_m(shapes[k]);
  }
  const PerJoint<LinkInertia> inertias = link_inertias(machine, sizes_m);
  fmt::print(out,
             "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- Written by {} from {}: {}.\n"
             "     Frame of base: origin at the boom pin, x forward, z up. Joint angles as in the machine file.\n"
             "     The shapes are boxes for display. Not in the model: friction, the hull's mass, the cylinders' own "
             "motion. -->\n"
             "<robot name=\"{}\">\n",
             cli::program_version(), remark(std::filesystem::path(machine.source).filename()),
             remark(origin_of_model(machine)), report::escaped(machine.name));
  out << "  <material name=\"paint\"><color rgba=\"0.95 0.65 0.1 1\"/></material>\n"
         "  <material name=\"hull\"><color rgba=\"0.3 0.3 0.32 1\"/></material>\n  <link name=\"base\">\n";
  write_shape(out, hull_shape(machine), "hull");
  out << "  </link>\n";
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    write_link(out, kJointNames[k], inertias[k], shapes[k]);
    write_joint(out, machine, kinematics, i);
  }
  fmt::print(out,
             "  <link name=\"tip\"/>\n  <joint name=\"tip_joint\" type=\"fixed\">\n    <parent link=\"bucket\"/>\n"
             "    <child link=\"tip\"/>\n    <origin xyz=\"{} 0 0\"/>\n  </joint>\n</robot>\n",
             machine.links[kBucket].length_m);
}

}  // namespace knuckle::exporting
