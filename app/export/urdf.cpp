#include <fmt/format.h>
#include <fmt/ostream.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/export/export_command.h"
#include "app/report/html.h"
#include "core/error.h"
#include "core/joints.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::exporting {
namespace {

// Boxes that a machine is drawn with where no meshes are: in the file of its model, and to choose what its links'
// inertia across the plane is.

/// A box along a line in the arm's plane, or beside it.
struct Bar {
  PlanarVector from_m, to_m;  ///< Axes of its link, or of M.
  double height_m = 0;        ///< In the plane, across the line.
  double width_m = 0;         ///< Across the plane.
  double aside_m = 0;         ///< Of its middle from the plane, along y.
};
using Shape = std::vector<Bar>;

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

/// Hull and tracks; of both, the description has the boom pin's place only.
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

/// Boom and arm: bars from pin to pin; bucket: plates along its outline, open at the mouth.
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

/// Of the smallest box around all corners of a link's bars, along x, y and z of its axes; every number above 0.
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

/// About the centre of mass, in axes parallel to the link's: x along the link, z to its left, y into the plane.
struct LinkInertia {
  double mass_kg = 0;
  PlanarVector com_m = PlanarVector::Zero();  ///< x and z in link axes.
  Eigen::Vector3d moment_kgm2 = {0, 0, 0};    ///< I_xx, I_yy, I_zz; the products are 0.
};

/// Of a uniform box around the link: along x, y and z of its axes.
using LinkSize = Eigen::Vector3d;

/// Least I_i, as a share of what a uniform box has: a link that is all in one point would be no link.
constexpr double kLeastShare = 0.01;
/// Masses are tried from 1/2 to 2 times the drawing's, in steps of a sixteenth of an octave.
constexpr int kSteps = 16;

struct PlanarLink {
  double mass_kg;
  PlanarVector com_m;
  double inertia_kgm2;  ///< About the centre of mass.
};

PlanarLink planar_link(const estimation::BaseParameters& parameters, int link, double length_m, double mass_kg,
                       double beyond_kg) {
  const PlanarVector moment(parameters[estimation::kMomentX + link] - length_m * beyond_kg,
                            parameters[estimation::kMomentZ + link]);
  const double about_joint = parameters[estimation::kInertia + link] - length_m * length_m * beyond_kg;
  return {mass_kg, moment / mass_kg, about_joint - moment.squaredNorm() / mass_kg};
}

/// S_x + S_z of the box, a kilogram.
double box_inertia_m2(const LinkSize& size_m) {
  return (size_m.x() * size_m.x() + size_m.z() * size_m.z()) / 12;
}

LinkInertia in_space(const PlanarLink& link, const LinkSize& size_m) {
  const Eigen::Vector3d box = link.mass_kg / 12 * size_m.cwiseAbs2();
  const double scale = link.inertia_kgm2 / (box.x() + box.z());
  const double sx = scale * box.x(), sy = box.y(), sz = scale * box.z();
  return {link.mass_kg, link.com_m, {sy + sz, link.inertia_kgm2, sx + sy}};
}

PerJoint<PlanarLink> links_of(const MachineDescription& machine, const estimation::BaseParameters& parameters,
                              const JointVector& mass_kg) {
  PerJoint<PlanarLink> links;
  double beyond_kg = 0;
  for (int i = kJoints - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    links[k] = planar_link(parameters, i, machine.links[k].length_m, mass_kg[i], beyond_kg);
    beyond_kg += mass_kg[i];
  }
  return links;
}

bool possible(const PerJoint<PlanarLink>& links, const PerJoint<LinkSize>& size_m) {
  for (std::size_t k = 0; k < kJoints; ++k) {
    const double least = kLeastShare * links[k].mass_kg * box_inertia_m2(size_m[k]);
    if (!(links[k].inertia_kgm2 >= least)) return false;
  }
  return true;
}

/// Possible links with masses nearest to `drawn_kg`: the least sum of squared logarithms of the factors.
std::optional<PerJoint<PlanarLink>> nearest_possible(const MachineDescription& machine,
                                                     const estimation::BaseParameters& parameters,
                                                     const JointVector& drawn_kg, const PerJoint<LinkSize>& size_m) {
  std::optional<PerJoint<PlanarLink>> nearest;
  double least_distance = 0;
  for (int boom = -kSteps; boom <= kSteps; ++boom) {
    for (int arm = -kSteps; arm <= kSteps; ++arm) {
      for (int bucket = -kSteps; bucket <= kSteps; ++bucket) {
        const JointVector octaves = JointVector(boom, arm, bucket) / kSteps;
        if (nearest && octaves.squaredNorm() >= least_distance) continue;
        const JointVector factor = octaves.unaryExpr([](double octave) { return std::exp2(octave); });
        const auto links = links_of(machine, parameters, drawn_kg.cwiseProduct(factor));
        if (!possible(links, size_m)) continue;
        nearest = links;
        least_distance = octaves.squaredNorm();
      }
    }
  }
  return nearest;
}

/// @param machine as calibrated() gives it. @param size_m of the links as drawn; every number above 0.
/// @return links of which estimation::known_parameters(machine) are the nine numbers.
/// @throws InputError where no masses from half to twice the drawing's make links of steel with these parameters.
PerJoint<LinkInertia> link_inertias(const MachineDescription& machine, const PerJoint<LinkSize>& size_m) {
  const estimation::BaseParameters parameters = estimation::known_parameters(machine);
  const JointVector drawn_kg = estimation::lumped_masses_kg(machine);
  const std::optional<PerJoint<PlanarLink>> links = machine.dynamics_calibration
                                                        ? nearest_possible(machine, parameters, drawn_kg, size_m)
                                                        : links_of(machine, parameters, drawn_kg);
  if (!links)
    throw InputError(
        machine.source +
        ": key 'calibration.dynamics': no links of 0.5 to 2 times the drawing's masses have these inertias "
        "and moments; identify the machine again");
  PerJoint<LinkInertia> all;
  for (std::size_t k = 0; k < kJoints; ++k) all[k] = in_space((*links)[k], size_m[k]);
  return all;
}

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
