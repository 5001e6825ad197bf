#include "app/export/link_inertia.h"

#include <cmath>
#include <optional>

#include "core/error.h"
#include "estimation/regressor.h"
#include "machine/description.h"

namespace knuckle::exporting {
namespace {

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

}  // namespace

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

}  // namespace knuckle::exporting
