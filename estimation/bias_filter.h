// The bias filter ("dynamic tare"): a Kalman filter that learns, in free motion, what the nominal model has wrong
// today: pressure offsets, friction, oil viscosity, gravity moments, lag. A calibrated machine starts with what its
// identification left uncertain and what changes from day to day.
//
// In free motion the external torque is zero, so the nominal observer's answer e is minus the model error:
// e = -H x + noise, where x are small corrections with priors. The correction H x is then added to every answer.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <numbers>

#include "core/joints.h"
#include "estimation/observer.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

// How far machines of this kind yield behind their encoders: no drawing says it.

/// [rad/(N m)] Standard deviation of the angle by which each link is behind its encoder, per torque of its cylinder:
/// boom, arm and bucket bend, and the ground under the tracks yields to the boom. Larger machines yield less.
/// Sizes: sim/README.md, serviced machines.
[[nodiscard]] JointVector usual_compliance_radpNm(const MachineDescription& machine);

// What the rates of the cylinders' torques tell: how the links move that no encoder sees, and what transmitters miss
// that are late.

/// Columns of the bias filter: what an observer's torque lacks by what yields at each joint [per rad/(N m)], and by the
/// lag that all transmitters have [per s].
using UnseenColumns = Eigen::Matrix<double, kJoints, kJoints + 1>;

/// Pins, steel and the ground under the tracks yield to the torques of the cylinders, whose lengths the encoders
/// measure in front of all that. A link is behind its encoder by c tau, tau the cylinder's torque on its joint and c
/// [rad/(N m)] the compliance of what lies between, the hull on its tracks included: the boom's torque turns it and
/// with it everything. Far below the frequencies of hull and steel (8 Hz and more) that holds at every moment, so the
/// links move by -c tau' in addition. Of that motion's momentum -M c tau' the observer makes -M c a (tau' - F tau'),
/// which is linear in c.
///
/// Transmitters that answer with the time constant T read tau where tau + T tau' is: the observer's torque lacks -T F
/// tau', linear in T. Exactly it is lever times the force's rate; the lever's own, which is in tau', is some 4 N m at a
/// fast boom of the 1.5 t class.
///
/// F tau' = a (tau - F tau), and a (tau' - F tau') is its rate: a difference of samples, half a step late, is taken
/// only where it has to be. Half a step of T F tau' would be a fifth of it at the edge of the contact channel.
class TorqueRate {
 public:
  TorqueRate(double observer_Hz, double step_s) noexcept
      : gain_(2.0 * std::numbers::pi * observer_Hz), step_s_(step_s), torque_(observer_Hz, step_s) {}
  void reset(const JointVector& cylinder_Nm) noexcept;
  /// @param cylinder_Nm torques of the pressures, as late as the channel's speed.
  void step(const JointVector& cylinder_Nm) noexcept;
  /// @param inertia_kgm2 M of the relative joints, in this pose.
  [[nodiscard]] UnseenColumns columns(const Eigen::Matrix3d& inertia_kgm2) const noexcept;

 private:
  double gain_, step_s_;
  FohFilter<JointVector> torque_;
  JointVector late_rate_Nmps_ = JointVector::Zero();  ///< F tau'
  JointVector shaken_Nmps2_ = JointVector::Zero();    ///< a (tau' - F tau')
};

inline constexpr int kBiasStates = 22;
/// x: per cylinder bias [N], Coulomb [N], viscous [N s/m], friction of the seals by pressure [m^2]; per link X and Z
/// [kg m]; per joint how far it yields behind its encoder [rad/(N m)]; how late all pressures come [s].
enum BiasState {
  kBiasOffset = 0,
  kBiasCoulomb = 3,
  kBiasViscous = 6,
  kBiasSeal = 9,
  kBiasMomentX = 12,
  kBiasMomentZ = 15,
  kBiasBending = 18,
  kBiasLag = 21
};
inline constexpr int kBiasUnseen = UnseenColumns::ColsAtCompileTime;  ///< From kBiasBending to the end.
static_assert(kBiasBending + kBiasUnseen == kBiasStates);
inline constexpr double kUsualLag_s = 5e-3;  ///< Of transmitters that have not shown theirs.
using BiasVector = Eigen::Matrix<double, kBiasStates, 1>;
using BiasMatrix = Eigen::Matrix<double, kBiasStates, kBiasStates>;
/// H in relative joints: joint i sees its own cylinder's four corrections, the moments of links k >= i, the inertia
/// of what yields anywhere, and the lag that all transmitters have: they are of one make.
using BiasColumns = Eigen::Matrix<double, kJoints, kBiasStates>;

/// The signals H is made of (each filtered like the residual it belongs to).
struct BiasSignals {
  JointVector lever, lever_dahl, lever_speed, lever_dahl_pressure, gravity_x, gravity_z;
  UnseenColumns unseen = UnseenColumns::Zero();  ///< Of what yields and of the lag.
  [[nodiscard]] BiasColumns columns() const noexcept;
};

/// One measurement in free motion.
struct BiasSample {
  BiasSignals signals;
  JointVector residual_Nm;   ///< e, nominal model
  JointVector variance_Nm2;  ///< Of one measurement taken alone.
};

class BiasFilter {
 public:
  /// An update is queued this often, and learned after kDelayedUpdates more. A contact meanwhile discards the queue, so
  /// that the second before it is not learned.
  static constexpr double kUpdateEvery_s = 0.05;
  static constexpr int kDelayedUpdates = 20;
  static constexpr double kRepeats = 20;  ///< Updates of one second are not independent: each counts a twentieth.
  static constexpr double kNisMemory_s = 30;

  explicit BiasFilter(const MachineDescription& machine);

  /// Random walk of the corrections over `duration_s` (oil warms; only while learning is allowed).
  void predict(double duration_s) noexcept;
  /// Queues one measurement update and learns from the one that has been waiting longest, once the queue is full.
  void update(const BiasSample& sample) noexcept;
  /// Something touched the machine: forget the updates not yet learned.
  void discard() noexcept { queued_ = 0; }

  [[nodiscard]] const BiasVector& state() const noexcept { return x_; }
  [[nodiscard]] const BiasMatrix& covariance() const noexcept { return p_; }
  /// Normalised innovation squared, mean of the three joints: e^2 / (H P H' + R) of one update before it is learned. 1
  /// on average where model and variances are right; NaN before the first update.
  [[nodiscard]] double mean_nis() const noexcept { return mean_nis_; }  ///< Over the last half minute of updates.
  /// Seconds of free motion learned so far.
  [[nodiscard]] double learned_s() const noexcept { return learned_s_; }

 private:
  void expect_drawing(const MachineDescription& machine);
  void expect_bending(const MachineDescription& machine);
  void expect_lag();
  void expect_calibrated(const MachineDescription& machine, const DynamicsCalibration& found);
  void learn(const BiasSample& sample) noexcept;

  BiasVector x_ = BiasVector::Zero();
  BiasMatrix p_ = BiasMatrix::Zero();
  BiasVector walk_ = BiasVector::Zero();   ///< Variance per second.
  BiasVector prior_ = BiasVector::Zero();  ///< Variance no correction grows beyond.
  BiasVector least_ = BiasVector::Zero();  ///< Nor falls below.
  std::array<BiasSample, kDelayedUpdates> queue_{};
  int queued_ = 0, next_ = 0;
  double learned_s_ = 0;
  double last_nis_ = std::numeric_limits<double>::quiet_NaN(), mean_nis_ = last_nis_;
};

}  // namespace knuckle::estimation
