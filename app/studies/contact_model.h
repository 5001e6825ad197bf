// The machine-side contact loop as a linear model about one hold: which give-way it bears, and where it then swings.
//
// Three joints on their oil, one place of the bucket in a wall, valves with dead time and spool, the law behind sampled
// filters. With s = j w, small signals, K = diag(Kp), T the law's map from tip to joints (docs/control.md, C = T
// T'/Ks):
//
//   arm      (M s^2 + D s + k) q = l F + Jc' f,   D = l^2 F_v + Dd: viscous and seals' damping of the rods
//   wall     f = -(n n' (kn + s dn) + t t' (kt + s dt)) Jc q                      Merritt 1967, 6.1, for what follows:
//   oil      s F = kq o - kl l s q,   kl = b_A A_A^2 / V_A + b_B A_B^2 / V_B      stiffness of both chambers
//            kq = b_A A_A g_A / V_A + b_B A_B g_B / V_B                           g: flow of an edge per opening
//   valve    o = l w / v_1 G(s),   G = H(s) e^(-s t_d) / (1 + 2 z s / w_v + s^2 / w_v^2),   v_1: speed per opening
//            that the law believes in, H: held between set-points
//   estimate tau = J' f / ((1 + s / w_e)^2 (1 + s / w_o)): fast channel of the force estimator; J of the tip, wherever
//            the force acts
//   law      w = -K q + (1/Ks) K T T' tau
//
// The loop is broken at y = T' tau (2 x 2): y = (1/Ks) B(s) y with B = T' P_t (1 + K P_q)^-1 K T, where P_q and P_t
// lead from the wanted rates w to q and tau. It swings where an eigenvalue of B(j w) is real and positive: at
// Ks = that eigenvalue. The largest such Ks is the border; softer (smaller Ks) is unstable. Delays are exact.
#pragma once

#include <array>
#include <complex>
#include <functional>
#include <optional>

#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::studies {

/// Where the machine holds: as its own sensors show it.
struct ContactHold {
  JointVector joint_rad = JointVector::Zero();
  std::array<double, 6> chamber_Pa{};                   ///< boom A, B, arm A, B, bucket A, B
  PlanarVector normal = PlanarVector(-1, 0);            ///< Of the wall, towards its free side; unit, frame M.
  PlanarVector place_m = PlanarVector::Zero();          ///< That touches, bucket axes.
  double wall_N_per_m = 1e6, wall_damping_ratio = 0.3;  ///< Of the place's effective mass on the wall.
  bool sticks = true;                                   ///< Along the wall: held by friction, else free.
};

/// What no machine file says; nominal.
struct ContactNominal {
  /// Oil with entrained air: b = b_0 / (1 + share (p_a / (p + p_a))^3), b_0 of the machine file.
  double air_share = 15, air_Pa = 6e5;
  double laminar_drop_Pa = 2e5;  ///< Below it an edge's flow is linear in its drop.
  double bus_delay_s = 6e-3;     ///< SYNC to sample to law (a period) and set-point to spool driver.
  double along_N_per_m = 2e6, along_Ns_per_m = 4e3;            ///< Of a place that sticks to the wall.
  estimation::ChannelBand force_band = estimation::kFastBand;  ///< Of the force that the law gives way to.
  double seal_N_per_m = 3.5e6;                                 ///< Of seals that do not slide yet.
};

struct ContactCrossing {
  double stiffness_N_per_m = 0;  ///< Ks at which the loop swings with this frequency.
  double frequency_Hz = 0;
};

struct ContactMargins {
  double crossover_Hz = 0, phase_margin_deg = 0;
};

/// Both eigenvalues of B at j w [rad/s].
using LoopEigenvalues = std::function<std::array<std::complex<double>, 2>(double w_radps)>;
/// Where an eigenvalue is real and positive, between 0.08 and 32 Hz: the largest; nullopt: nowhere.
[[nodiscard]] std::optional<ContactCrossing> swing_border(const LoopEigenvalues& eigenvalues);

/// What of a sine a dead zone of +-dead_zone passes (Gelb, Vander Velde: Multiple-Input Describing Functions, 1968):
/// 1 - 2/pi (asin(d/A) + d/A sqrt(1 - (d/A)^2)).
[[nodiscard]] double dead_zone_gain(double dead_zone, double amplitude) noexcept;

class ContactLoop {
 public:
  /// @throws InputError as Kinematics does; std::invalid_argument for a pose beyond a linkage's reach.
  ContactLoop(const MachineDescription& machine, const ContactHold& hold, const ContactNominal& nominal = {});

  /// The largest Ks at which an eigenvalue of B/Ks is 1; nullopt: no Ks makes this loop swing.
  [[nodiscard]] std::optional<ContactCrossing> border() const;
  /// The same where each valve passes what its uncompensated dead band leaves of a swing of the contact force by
  /// +-swing_N, about closed valves (describing function): a loop that is softer goes on swinging once it swings so.
  [[nodiscard]] std::optional<ContactCrossing> border_with_dead_band(double swing_N) const;
  /// The smallest swing +-N of the contact force that goes on at this Ks in spite of the dead bands (an unstable limit
  /// cycle: less dies away, more grows); nullopt: the loop calms down after any swing.
  [[nodiscard]] std::optional<double> lasting_swing_N(double stiffness_N_per_m) const;
  /// Of the place against the wall, joints free: what a touch is the impact of.
  [[nodiscard]] double effective_mass_kg() const noexcept { return effective_mass_kg_; }
  /// Of the eigenvalue that crosses 1 in size last; nullopt: none does.
  [[nodiscard]] std::optional<ContactMargins> margins(double stiffness_N_per_m) const;
  /// Both eigenvalues of B(j w), the larger first.
  [[nodiscard]] std::array<std::complex<double>, 2> eigenvalues(double w_radps) const {
    return eigenvalues(w_radps, JointVector::Ones());
  }

 private:
  struct Axis {
    double lever_m = 0;
    double oil_N_per_m = 0;    ///< kl
    double flow_share = 0;     ///< kq / (kl v_1): of the speed that the law believes in
    double dead_zone_mps = 0;  ///< Wanted speed below which the valve stays shut.
    double damping_Ns_per_m = 0, seal_N_per_m = 0;
    double valve_radps = 0, valve_damping = 0, delay_s = 0;
  };
  void touch(const Eigen::Matrix<double, 2, 3>& tip);
  [[nodiscard]] CylinderState cylinder(std::size_t i) const;
  [[nodiscard]] std::array<JointVector, 2> supplies_Pa() const;
  [[nodiscard]] Axis axis(std::size_t i, const std::array<JointVector, 2>& supply_Pa) const;
  [[nodiscard]] std::array<std::complex<double>, 2> eigenvalues(double w_radps, const JointVector& valve_gain) const;
  [[nodiscard]] std::optional<ContactCrossing> border(const JointVector& valve_gain) const;
  [[nodiscard]] double bulk_modulus_Pa(double pressure_Pa) const noexcept;

  MachineDescription machine_;
  ContactHold hold_;
  ContactNominal nominal_;
  Kinematics kinematics_;
  Eigen::Matrix3d mass_;
  double effective_mass_kg_ = 0;
  PerJoint<Axis> axes_;
  Eigen::Matrix3d wall_N_, wall_Ns_;       ///< Joint torques against joint angles, and against rates.
  Eigen::Matrix3d felt_N_, felt_Ns_;       ///< The same forces as if they acted at the tip.
  Eigen::Matrix<double, 3, 2> to_joints_;  ///< T
  JointVector gains_;                      ///< Diagonal of K.
};

}  // namespace knuckle::studies
