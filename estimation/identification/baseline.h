// What the papers' methods share: when to refuse data, and the tip force that explains joint torques as they take it:
// no weights, no prior, no history.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/motion.h"
#include "estimation/identification/recording.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// What forbids identification before it is tried, each one line: too short, pressures that never change, joints that
/// hardly move. Joints before `first` are not looked at. Empty: go on.
[[nodiscard]] std::vector<std::string> unfit(std::span<const Motion> motions, int first, double least_s,
                                             double least_span_rad);

/// Torques of the cylinders on the relative joints, r F.
[[nodiscard]] inline JointVector cylinder_torque(const Motion& motion, Eigen::Index sample) {
  return motion.lever_m.col(sample).cwiseProduct(motion.cylinder_N.col(sample));
}

/// A comparison of so many samples, nothing usable yet.
[[nodiscard]] TorqueComparison empty_comparison(const Motion& motion);

/// Below it two links count as one straight one: a few N m of torque error would be a large force.
inline constexpr double kStraightSine = 0.2;

/// Torques of the world on arm and bucket joint -> force on the tip, from these two equations alone (M: two cylinders).
/// @param jacobian d tip / d joints; @param torque_Nm its boom entry is not used.
/// @return NaN where the bucket is in line with the arm: nothing along that line reaches either joint.
[[nodiscard]] PlanarVector force_of_two_joints(const PlanarJacobian& jacobian, const JointVector& joints_rad,
                                               const JointVector& torque_Nm);

/// Three torques -> two unknowns, ordinary least squares.
[[nodiscard]] PlanarVector force_of_three_joints(const PlanarJacobian& jacobian, const JointVector& joints_rad,
                                                 const JointVector& torque_Nm);

/// Three torques -> (Fx, Fz [N], torque about the tip [N m]) by matrix inversion (K, figure 8).
/// @return NaN where the arm is in line with the boom: the determinant is l1 l2 sin(arm).
[[nodiscard]] Eigen::Vector3d wrench_of_three_joints(const PlanarJacobian& jacobian, const JointVector& joints_rad,
                                                     const JointVector& torque_Nm);

/// Torque of the world on the joints is what the model asks for and the cylinders did not give.
/// @param solve one of the three above. @return one answer a sample, NaN where the comparison is not usable.
template <typename Solve>
[[nodiscard]] auto solve_each(const MachineDescription& machine, const Motion& motion, const TorqueComparison& torque,
                              Solve solve) {
  const Kinematics kinematics(machine);
  using Answer = decltype(solve({}, {}, {}));
  std::vector<Answer> answers(torque.usable.size(), Answer::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (torque.usable[i] == 0) continue;
    const JointVector joints = motion.joint_rad.col(static_cast<Eigen::Index>(i));
    answers[i] = solve(kinematics.tip_jacobian(joints), joints, torque.modelled_Nm[i] - torque.measured_Nm[i]);
  }
  return answers;
}

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
[[nodiscard]] KimResult identify_kim(const MachineDescription& machine, std::span<const Recording> recordings);

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

// Identification in motion as Malaguti & Zaghi did it ("Force sensor by driving hydraulic cylinders", 3.2): stick and
// bucket as two links, no accelerations thanks to the filtered regressor, friction of both cylinders with it.
//
//   [Q_3, Q_2] = [tau_3, tau_2 - tau_3] = d/dt(Y_p phi) + Y_v phi + friction,  all of it through a / (s + a);
//   friction f_c sgn v + f_v v at the rod: r_3 in row 3; r_2, and minus what row 3 has, in row 2.
//
// The boom is a known moving base: its angle (tilt sensor and encoder) carries the links, its own parameters do not
// show. The paper treats the two rows as two problems; they share parameters, so here they are one, each row weighted
// with what it leaves over. Its misprints are listed in docs/theory.md.

/// The authors' own by default. Another filter and window are what repairs the inertias.
struct MalagutiOptions {
  double sampling_s = 0.01;  ///< Faster recordings are thinned.
  double window_s = 0.07;    ///< Savitzky-Golay, 2 n_w + 1 = 7 samples
  int order = 2;             ///< m
  double filter_Hz = 20;     ///< a / 2 pi
  double least_s = 20;       ///< Less motion is refused; the paper has 40 s.
};

/// The same with less noise in the columns: 2 Hz, and a cubic over 41 samples.
[[nodiscard]] constexpr MalagutiOptions repaired_malaguti_options() noexcept {
  return {.window_s = 0.41, .order = 3, .filter_Hz = 2};
}

inline constexpr int kMalagutiCount = 10;
using MalagutiVector = Eigen::Matrix<double, kMalagutiCount, 1>;

struct MalagutiResult {
  Identification summary;  ///< Table 2: phi_D1, phi_D2, phi_S1..S4, phi_f1..f4.
  MalagutiOptions options;
  /// J3, J2 [kg m^2], X3, Z3, X2, Z2 [kg m], f_c3 [N], f_v3 [N s/m], f_c2, f_v2 (link 2 the stick, 3 the bucket).
  MalagutiVector parameters = MalagutiVector::Zero();
};

/// Poor data is not thrown at: summary.usable is false and the reasons say why.
/// @throws InputError as Kinematics does.
[[nodiscard]] MalagutiResult identify_malaguti(const MachineDescription& machine, std::span<const Recording> recordings,
                                               const MalagutiOptions& options = {});

/// Torques of stick and bucket cylinder behind the filter, as the paper compares them; NaN for the boom. The first
/// samples after a gap are not usable.
[[nodiscard]] TorqueComparison compare_torque(const MalagutiResult& result, const MachineDescription& machine,
                                              const Recording& recording);

/// Force of the world on the tip, frame M, from stick and bucket alone (two unknowns from two torques). NaN where the
/// bucket is nearly in line with the stick.
[[nodiscard]] std::vector<PlanarVector> external_force(const MalagutiResult& result, const MachineDescription& machine,
                                                       const Recording& recording);

}  // namespace knuckle::estimation
