// Identification as Kim et al. did it ("Design of haptic device for excavator with pressure transmitter"): slow motion,
// nonlinear least squares on gravity and one viscous friction at each joint, no inertia.
//
//   tau_i = G_i(theta) + mu_i thetadot_i,  G_3 = m3 g L3 cos(phi_3 + A3),
//   G_2 = G_3 + g [m2 L2 cos(phi_2 + A2) + m3 l2 cos phi_2],
//   G_1 = G_2 + g [m1 L1 cos(phi_1 + A1) + (m2 + m3) l1 cos phi_1]
//
// The paper estimates m_i L_i, A_i and mu_i (its table 1) and says nothing of m2 and m3, which stand alone in G_1 and
// G_2. They cannot come from the data: each shows only in sums with m_i L_i, six combinations in all. They are taken
// from the machine file and labelled so.
#pragma once

#include <span>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct KimOptions {
  double sampling_s = 0.015;  ///< As in the paper; faster recordings are thinned.
  double window_s = 0.105;    ///< Of the quadratic that rates come from: 7 samples. The paper does not say how.
  double least_s = 20;        ///< Less slow motion than this is refused.
};

struct KimModel {
  JointVector moment_kgm = JointVector::Zero();    ///< m_i L_i
  JointVector offset_rad = JointVector::Zero();    ///< A_i
  JointVector friction_Nms = JointVector::Zero();  ///< mu_i, N m per rad/s of the relative joint
  double arm_kg = 0, bucket_kg = 0;                ///< m2, m3, of the machine file
};

struct KimResult {
  Identification summary;
  KimModel model;
};

/// @return never throws for poor data: summary.usable is false and the reasons say why.
/// @throws InputError as Kinematics does.
[[nodiscard]] KimResult identify_kim(const MachineDescription& machine, std::span<const Recording> recordings,
                                     const KimOptions& options = {});

/// Model torque is quasi-static: inertia shows as a difference.
[[nodiscard]] TorqueComparison compare_torque(const KimResult& result, const MachineDescription& machine,
                                              const Recording& recording);

/// Force of the world on the tip, frame M, one a sample: two unknowns from three torques by least squares. NaN where
/// the sample is not usable.
[[nodiscard]] std::vector<PlanarVector> external_force(const KimResult& result, const MachineDescription& machine,
                                                       const Recording& recording);

/// (Fx, Fz [N], torque about the tip [N m]) as in figure 8, by matrix inversion. NaN near the straight arm.
[[nodiscard]] std::vector<Eigen::Vector3d> external_wrench(const KimResult& result, const MachineDescription& machine,
                                                           const Recording& recording);

}  // namespace knuckle::estimation
