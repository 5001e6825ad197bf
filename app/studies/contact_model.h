// The machine-side contact loop as a linear model about one hold: how far it is from swinging, and at which frequency
// it would. With s = j w, small signals:
//
//   arm      (M s^2 + D s + k) q = l F + Jc' f,   D = l^2 F_v, k = l^2 k_seal: viscous rods on seals that do not slide
//   wall     f = -(n n' (kn + s dn) + t t' (kt + s dt)) Jc q                      Merritt 1967, 6.1, for what follows:
//   oil      s F = kq o - kl l s q,   kl = b_A A_A^2 / V_A + b_B A_B^2 / V_B      stiffness of both chambers
//            kq = b_A A_A g_A / V_A + b_B A_B g_B / V_B                           g: flow of an edge per opening
//   valve    o = l w / v_1 G(s),   G = H(s) e^(-s t_d) / (1 + 2 z s / w_v + s^2 / w_v^2),   v_1: speed per opening
//            that the law believes in, H: held between set-points
//   estimate f_e = f / ((1 + s / w_e)^2 (1 + s / w_o)): fast channel of the force estimator, place and size exact
//   law      w = -A q + G_f f_e,   A = S Kp,   G_f = S Kp d give / d f: slave::ContactLaw about the hold's force
//
// The loop is broken at f (2 x 2): f = L(s) f. It swings where an eigenvalue of L(j w) is real and 1. Delays are exact.
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

/// Where the machine holds: as its own sensors show it, and the force that the wall has on it.
struct ContactHold {
  JointVector joint_rad = JointVector::Zero();
  std::array<double, 6> chamber_Pa{};                   ///< boom A, B, arm A, B, bucket A, B
  PlanarVector normal = PlanarVector(-1, 0);            ///< Of the wall, towards its free side; unit, frame M.
  PlanarVector place_m = PlanarVector::Zero();          ///< That touches, bucket axes.
  PlanarVector force_N = PlanarVector::Zero();          ///< Of the wall on it, frame M.
  double wall_N_per_m = 1e6, wall_damping_ratio = 0.3;  ///< Of the place's effective mass on the wall.
  bool sticks = true;                                   ///< Along the wall: held by friction, else free.
};

/// What no machine file says; nominal.
struct ContactNominal {
  /// Oil with entrained air: b = b_0 / (1 + share (p_a / (p + p_a))^3), b_0 of the machine file.
  double air_share = 15, air_Pa = 6e5;
  double oil_share = 1;          ///< True b_0 over that of the machine file, which the law believes in.
  double laminar_drop_Pa = 2e5;  ///< Below it an edge's flow is linear in its drop.
  double bus_delay_s = 4.7e-3;   ///< SYNC to the next step 4.3 ms, its set-points to the spools' drivers 0.4 ms.
  double along_N_per_m = 2e6, along_Ns_per_m = 4e3;            ///< Of a place that sticks to the wall.
  estimation::ChannelBand force_band = estimation::kFastBand;  ///< Of the force that the law gives way to.
  double seal_N_per_m = 3.5e6;                                 ///< Of seals that do not slide yet.
};

struct LoopCrossing {
  double gain = 0;  ///< An eigenvalue of L that is real and positive: 1 swings on, less dies away.
  double frequency_Hz = 0;
};

struct ContactMargins {
  double crossover_Hz = 0, phase_margin_deg = 0;
};

/// Both eigenvalues of L at j w [rad/s].
using LoopEigenvalues = std::function<std::array<std::complex<double>, 2>(double w_radps)>;
/// Where an eigenvalue is real and positive, between 0.08 and 32 Hz: the largest; nullopt: nowhere.
[[nodiscard]] std::optional<LoopCrossing> largest_crossing(const LoopEigenvalues& eigenvalues);

class ContactLoop {
 public:
  /// @throws InputError as Kinematics does; std::invalid_argument for a pose beyond a linkage's reach.
  ContactLoop(const MachineDescription& machine, const ContactHold& hold, const ContactNominal& nominal = {});

  /// The closest to swinging: one over its gain is the gain margin. nullopt: no gain makes this loop swing.
  [[nodiscard]] std::optional<LoopCrossing> crossing() const;
  /// Of the eigenvalue that crosses 1 in size last; nullopt: none does.
  [[nodiscard]] std::optional<ContactMargins> margins() const;

 private:
  struct Axis {
    double lever_m = 0;
    double oil_N_per_m = 0;  ///< kl
    double flow_share = 0;   ///< kq / (kl v_1): of the speed that the law believes in
    double damping_Ns_per_m = 0, seal_N_per_m = 0;
    double valve_radps = 0, valve_damping = 0, delay_s = 0;
  };
  /// Both eigenvalues of L(j w), the larger first.
  [[nodiscard]] std::array<std::complex<double>, 2> eigenvalues(double w_radps) const;
  void touch_wall();
  void set_law();
  [[nodiscard]] CylinderState cylinder(std::size_t i) const;
  [[nodiscard]] std::array<JointVector, 2> supplies_Pa() const;
  [[nodiscard]] Axis axis(std::size_t i, const std::array<JointVector, 2>& supply_Pa) const;
  [[nodiscard]] double bulk_modulus_Pa(double pressure_Pa) const noexcept;

  MachineDescription machine_;
  ContactHold hold_;
  ContactNominal nominal_;
  Kinematics kinematics_;
  Eigen::Matrix3d mass_;
  PerJoint<Axis> axes_;
  PlanarVector from_tip_m_;                       ///< To the place, frame M.
  Eigen::Matrix<double, 2, 3> place_;             ///< Jc
  Eigen::Matrix2d wall_N_per_m_, wall_Ns_per_m_;  ///< Against the place's way and speed.
  Eigen::Matrix3d rate_per_rad_;                  ///< A
  Eigen::Matrix<double, 3, 2> rate_per_N_;        ///< G_f
};

/// contact_crossover_radps: from where on a border is looked for, what a machine file may say at most, and so much that
/// the arm is slowed nowhere.
inline constexpr double kSlowest_radps = 2, kFastest_radps = 100, kNoBound_radps = 1e6;
/// Value of a key of the law, and how fast the loop swings there.
struct PredictedBorder {
  double value = 0, frequency_Hz = 0;
};
/// The smallest Ks at which the loop is calm without bound of its crossover. nullopt: calm at any.
[[nodiscard]] std::optional<PredictedBorder> stiffness_border(MachineDescription machine, const ContactHold& hold,
                                                              const ContactNominal& nominal = {});
/// The largest contact_crossover_radps at which the loop is calm at the Ks of the file. nullopt: calm at any.
[[nodiscard]] std::optional<PredictedBorder> crossover_border(MachineDescription machine, const ContactHold& hold,
                                                              const ContactNominal& nominal = {});

}  // namespace knuckle::studies
