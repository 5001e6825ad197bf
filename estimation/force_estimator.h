// The force of the world on the bucket tip, from cylinder pressures: momentum observer on the machine's model (as
// calibrated, else as drawn) minus friction and bias, with covariance, confidence and contact event. Runs in
// the slave loop. Mechanisms and figures: docs/theory.md, docs/evaluation.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "core/filters.h"
#include "core/joints.h"
#include "estimation/bias_filter.h"
#include "estimation/contact_force.h"
#include "estimation/friction.h"
#include "estimation/joint_state.h"
#include "estimation/line_of_action.h"
#include "estimation/observer.h"
#include "estimation/regressor.h"
#include "estimation/tip_force.h"
#include "machine/arm_description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

// What a load in the bucket asks of the joints: columns of gravity torque for its mass and first moments.

/// (m [kg], m x, m z [kg m]), place in bucket axes.
using Load = Eigen::Vector3d;

/// Torques of a load on the joints are columns * load:
///   tau_bucket = -g (m x cos phi_3 - m z sin phi_3),  tau_arm = tau_bucket - g m l_arm cos phi_2,
///   tau_boom = tau_arm - g m l_boom cos phi_1.
[[nodiscard]] Eigen::Matrix3d load_columns(const JointVector& length_m, const Pose& pose) noexcept;

// Contact as an event: two-sided CUSUM per joint on the high-passed contact torque, so that whatever changes slowly
// (bias, gravity errors, a load being lifted) does not count and a step does at once.

class ContactCusum {
 public:
  static constexpr double kHighPass_Hz = 2;
  static constexpr double kDrift = 2;  ///< k, in standard deviations of the free signal.
  /// h, likewise, for a step of 5 ms. With 10, an hour of free air has four times as many false events
  /// (docs/theory.md). A hit that is clipped is noticed 6 ms later than with 10, one of four deviations 25 ms later.
  static constexpr double kThreshold = 20;
  static constexpr double kReferenceStep_s = 5e-3;
  static constexpr double kClip = 10;  ///< One sample adds no more: a single outlier is no contact.

  explicit ContactCusum(double step_s) noexcept
      : slow_(kHighPass_Hz, step_s, JointVector::Zero()), weight_(step_s / kReferenceStep_s) {}

  void reset(const JointVector& torque_Nm) noexcept {
    slow_.reset(torque_Nm);
    up_.setZero();
    down_.setZero();
  }

  /// @param sigma_Nm standard deviation of the high-passed signal in free motion, per joint.
  /// @return joint that crossed its threshold in this step, or -1. The sums start again after an alarm.
  int step(const JointVector& torque_Nm, const JointVector& sigma_Nm) noexcept;
  [[nodiscard]] const JointVector& high_passed_Nm() const noexcept { return high_passed_; }

 private:
  LowPass<JointVector> slow_;
  double weight_;
  JointVector up_ = JointVector::Zero(), down_ = JointVector::Zero(), high_passed_ = JointVector::Zero();
};

// How wrong the estimator is when nothing touches the machine, learned while nothing does.

/// Covariance of the joint torques less their bias in free motion of one speed class, less what the bias filter's own
/// covariance accounts for already: adding that to it gives the whole. Kept as running moments of the last kMemory_s of
/// updates; before the first updates a prior stands for them and counts as many as kPriorUpdates. Never below a tenth
/// of the prior's spread: a quiet minute makes no perfect estimator.
class FreeSpread {
 public:
  static constexpr double kMemory_s = 60;
  static constexpr double kPriorUpdates = 20;
  static constexpr double kSmallestPart = 0.1;      ///< Of the prior's spread.
  static constexpr double kLeastUnexplained = 0.5;  ///< Of the variance seen, whatever the bias filter says.

  FreeSpread(const JointVector& prior_variance_Nm2, double look_every_s) noexcept;

  /// @param explained_Nm2 variances that the bias filter's covariance gave this update. @param variance_Nm2 of the
  /// torques: of one that is not known (torque_weight.h) nothing is learned.
  void update(const JointVector& torque_Nm, const JointVector& explained_Nm2, const JointVector& variance_Nm2) noexcept;
  [[nodiscard]] const Eigen::Matrix3d& covariance_Nm2() const noexcept { return covariance_Nm2_; }

 private:
  /// Variances are reduced, correlations stay: so the matrix stays positive definite.
  void solve() noexcept;

  JointVector floor_Nm2_;
  Eigen::Matrix3d moment_Nm2_;
  JointVector explained_Nm2_ = JointVector::Zero();
  double updates_ = kPriorUpdates, most_updates_;
  Eigen::Matrix3d covariance_Nm2_;
};

/// Why the confidence is below 1 (bits).
enum ConfidenceReason : std::uint16_t {
  kStuckFriction = 1 << 0,  ///< at standstill friction hides force
  kNearSingular = 1 << 1,   ///< straight arm or bucket lever near its toggle
  kReliefOpen = 1 << 2,     ///< a relief valve limits what can be known
  kFastMotion = 1 << 3,
  kBiasNotLearned = 1 << 4,  ///< no free-motion adaptation yet
  kResidual = 1 << 5,        ///< no one force on the bucket explains all three torques: or a sensor is wrong
  kBadInput = 1 << 6,        ///< a non-finite value came in: the last estimate is repeated
  kEndStop = 1 << 7,         ///< a cylinder or joint is at its end stop, which takes force that no sensor sees
  kTorqueMissing = 1 << 8,   ///< nobody measures the pressures of one cylinder
  // The contact model refuses this pose (ContactRefusal).
  kStraightArm = 1 << 9,
  kBucketInLine = 1 << 10,
  kNearToggle = 1 << 11,
  kDirectionAlongLink = 1 << 12,
  kOffTheBucket = 1 << 13,
  kNoDirection = 1 << 14,
};
inline constexpr unsigned kConfidenceReasons = 15;  ///< How many there are.

/// ConfidenceReason bits in words, with commas; empty where none is set. Allocates.
[[nodiscard]] std::string doubt_text(std::uint16_t confidence_reasons);

struct ForceEstimate {
  JointVector joint_torque_Nm =
      JointVector::Zero();                           ///< External joint torque, observer at the force bandwidth (3 Hz).
  JointVector fast_torque_Nm = JointVector::Zero();  ///< Likewise at 6 Hz, for the slave's contact law, as at the tip.
  double fast_couple_Nm = 0;                         ///< What was taken out of it: of a force beside the tip.
  JointVector contact_torque_Nm = JointVector::Zero();             ///< Likewise at 12 Hz, for contact events alone.
  Eigen::Matrix3d joint_covariance_Nm2 = Eigen::Matrix3d::Zero();  ///< Of joint_torque_Nm, for any contact model.
  PlanarVector tip_N = PlanarVector::Zero();  ///< Force of the world on the tip, frame M, without what is carried.
  /// Likewise with the weight of what is carried: a steady pull down on a moving bucket cannot be told from a load.
  PlanarVector loaded_tip_N = PlanarVector::Zero();
  Eigen::Matrix2d covariance_N2 = Eigen::Matrix2d::Zero();
  double confidence = 0;  ///< [0, 1]
  std::uint16_t confidence_reasons = 0;
  double residual_sigma = 0;                                ///< Left-over of the 3-joint fit, in standard deviations.
  ContactModel contact_model = ContactModel::kBucketForce;  ///< That tip_N is an answer of.
  // More than a force at the tip, by the same model; less the load, as tip_N.
  double tip_torque_Nm = 0, tip_torque_variance_N2m2 = 0;           ///< About the tip.
  PlanarVector force_torque_covariance_N2m = PlanarVector::Zero();  ///< Of tip_N and that torque.
  LineOfAction line;
  std::array<double, kBucketSides> touched_share{};  ///< Of the outline's sides (TouchedSides).
  bool contact = false;                              ///< CUSUM alarm or significant force, now or up to 0.3 s ago.
  bool significant = false;                          ///< The force is larger than all that is uncertain about it.

  JointVector carried_Nm = JointVector::Zero();  ///< Of the load being carried; already taken out of all the others.

  /// What a cylinder without transmitters pushes with where only the arm's weight acts, by the model; 0 for the others.
  JointVector gravity_N = JointVector::Zero();

  // What belongs to joint_torque_Nm, as late as it is.
  JointVector rod_mps = JointVector::Zero();
  JointVector lever_m = JointVector::Zero();
  JointVector turned_lever_m = JointVector::Zero();  ///< Lever times the direction in which friction acts, [-1, 1].
  JointVector measurement_variance_Nm2 =
      JointVector::Zero();  ///< Of one measurement update: free-motion residual and stuck friction.
  JointVector stuck_variance_Nm2 = JointVector::Zero();  ///< In the covariance, of friction where a rod stands.
  JointVector bias_variance_Nm2 = JointVector::Zero();   ///< Of what the bias filter has not learned yet: lasts.
};

/// The reported force; the slave's contact law; contact events.
inline constexpr ChannelBand kSlowBand{3, 8}, kFastBand{6, 15}, kContactBand{12, 15};
inline constexpr double kSlowVelocity_Hz = kSlowBand.velocity_Hz;

class ForceEstimator {
 public:
  /// @throws InputError as Kinematics does.
  ForceEstimator(const MachineDescription& machine, double step_s);

  /// One step of the slave loop. Of `state` all but the rates is used: each channel makes its own rates, with its own
  /// lag. A non-finite state repeats the last estimate at confidence 0. The first call starts at rest.
  const ForceEstimate& step(const JointState& state) noexcept;

  /// The sensors were away for a while: the next step starts at rest where the machine is then. What was learned of it
  /// stays, but for the updates not yet learned.
  void restart_motion() noexcept { started_ = false; }

  /// true: a person confirms that nothing touches the machine. Until false, a large force is no sign of contact, so the
  /// bias filter learns it away; a sudden force still is one.
  void expect_free_motion(bool free_motion_certain) noexcept { free_motion_certain_ = free_motion_certain; }

  /// true: the bucket may be loaded. Until false, the bias filter learns nothing, or it would learn the load.
  void hold_bias(bool maybe_loaded) noexcept { maybe_loaded_ = maybe_loaded; }

  /// What the bucket is known to hold: its weight is no force of contact any more. Must change smoothly.
  void carry(const Load& load) noexcept { carried_ = load; }

  [[nodiscard]] const ForceEstimate& estimate() const noexcept { return estimate_; }
  [[nodiscard]] const BiasFilter& learned() const noexcept { return bias_; }

 private:
  /// Zero where the torque is not known.
  [[nodiscard]] JointVector of_known(const JointVector& torque_Nm) const noexcept;
  using Pushes = Eigen::Array<double, 6, 1>;  ///< cylinder torque, pressure sum
  [[nodiscard]] static Pushes pushes_of(const JointState& state) noexcept;
  /// A channel that is not reported: its bias goes in with the rest, its pushes pass twins of its velocity poles.
  struct QuickChannel {
    QuickChannel(const ChannelBand& band, double step_s, const JointVector& length_step_m) noexcept
        : motion(band, step_s, length_step_m),
          torque_rate(band.observer_Hz, step_s),
          first(band.velocity_Hz, step_s),
          second(band.velocity_Hz, step_s) {}
    ObserverChannel motion;
    TorqueRate torque_rate;
    FohFilter<Pushes> first, second;
  };
  using Bank = Eigen::Array<double, 15, 1>;   ///< lever, cylinder torque, gravity on X, gravity on Z, pressure sum
  using Speeds = Eigen::Array<double, 9, 1>;  ///< lever times: bristle, extension rate, bristle * pressure sum

  void start(const JointState& state) noexcept;
  void start(QuickChannel& channel, const Pose& pose, const JointState& state) noexcept;
  void slow_step(const Pose& pose, const JointState& state) noexcept;
  [[nodiscard]] JointVector quick_step(QuickChannel& channel, const Pose& pose, const JointState& state) noexcept;
  [[nodiscard]] JointVector stuck_variance(const ObserverChannel& channel) const noexcept;
  void watch_end_stops(const JointVector& joints_rad) noexcept;
  void watch_reliefs(const JointState& state) noexcept;
  [[nodiscard]] JointVector encoder_shake_Nm(const Pose& pose, const JointVector& lever_m,
                                             const ChannelBand& band) const noexcept;
  void update_covariance(const Pose& pose, const PlanarJacobian& jacobian, const PerJoint<bool>& known) noexcept;
  void answer(const JointState& state, const PlanarJacobian& jacobian) noexcept;
  void judge_contact() noexcept;
  void learn() noexcept;
  void judge_confidence(const ContactAnswer& answer) noexcept;

  PerJoint<LinkDescription> links_;
  PerJoint<CylinderDescription> cylinders_;
  HydraulicsDescription hydraulics_;
  JointVector length_step_m_;
  bool pins_calibrated_;
  Kinematics kinematics_;
  RigidArm arm_;
  ContactForce contact_force_;
  TouchedSides sides_;
  BaseParameters parameters_;
  PerJoint<CylinderFriction> friction_;
  double step_s_;

  bool started_ = false;
  bool free_motion_certain_ = false, maybe_loaded_ = false;
  Load carried_ = Load::Zero();
  JointVector last_angle_rad_ = JointVector::Zero();
  LowPass<double> pitch_;
  Eigen::Matrix3d inertia_kgm2_ = Eigen::Matrix3d::Zero();  ///< Of the relative joints, in this pose.
  RodVibration vibration_;
  ObserverChannel slow_;
  TorqueRate torque_rate_;
  QuickChannel fast_, contact_;
  FohFilter<Bank> matched_first_, matched_, bank_;  ///< Twins of the velocity filter's poles and the observer's.
  FohFilter<Speeds> speeds_;

  BiasSignals signals_;  ///< H, as late as the slow residual.
  JointVector raw_residual_Nm_ = JointVector::Zero();
  BiasFilter bias_;
  std::array<FreeSpread, 2> free_spread_;   ///< Of the reported torque: slow, fast motion.
  std::array<JointVector, 2> free_ripple_;  ///< Variance of the high-passed contact torque, likewise.
  JointVector pressure_sum_Pa_ = JointVector::Zero();
  JointVector stuck_variance_ = JointVector::Zero();
  JointVector slow_swing_variance_ = JointVector::Zero();  ///< What a swing makes of compliant masses; holds on.
  JointVector stop_variance_ = JointVector::Zero();        ///< What an end stop may take; holds on a little.
  JointVector turning_variance_ = JointVector::Zero();     ///< For the contact event: holds on after a rod turned.
  JointVector swing_variance_ = JointVector::Zero();       ///< Likewise: of what a swing makes of compliant masses.
  JointVector relief_variance_ = JointVector::Zero();
  ContactCusum cusum_;
  double mahalanobis2_ = 0;
  double untouched_s_ = 0, quiet_s_ = 0, since_update_s_ = 0;
  ForceEstimate estimate_;
};

}  // namespace knuckle::estimation
