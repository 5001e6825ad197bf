// Weighs what the bucket holds while it moves through free air: joint least squares on the external torques for mass
// and place of the load, both directions of motion, with a standard deviation. Step is real-time.
#pragma once

#include <Eigen/Dense>

#include "core/filters.h"
#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

/// A load m at (x, z) of the bucket's axes loads the joints with
///   tau_bucket = -g (m x cos phi_3 - m z sin phi_3),  tau_arm = tau_bucket - g m l_arm cos phi_2,
///   tau_boom = tau_arm - g m l_boom cos phi_1,
/// so the boom-minus-arm and arm-minus-bucket rows know nothing of where the load lies. Unknown beside m: how far
/// m (x, z) is from where the machine file says that loads lie; per cylinder a constant and a part with the direction
/// of motion (what the bias filter has not got right), all with priors. Moving both ways separates the last from the
/// load.
///
/// Its inertia counts as that of a mass at the usual place, with the acceleration that the rods show: a heavy load that
/// is slowed down looks 50 kg heavier for a moment.
///
/// Only motion counts (at rest friction hides the load), and only slow motion.
/// What presses down on a bucket that does not rise or sink may be a wall above it: until it has been lifted or lowered
/// by 3 cm, sigma says so.
/// A lift starts by itself whenever measurement updates disagree with the load known so far: a weight was hung on, a
/// piece scooped or dropped, the soil let go. A contact is not gravity-like, so it keeps starting new lifts and sigma
/// stays wide. Until the bias filter has learned, the bucket is taken to be empty.
class PayloadEstimator {
 public:
  static constexpr double kMemory_s = 15;  ///< Updates fade: today's oil warms up.
  static constexpr double kUpdateEvery_s = 0.05;

  PayloadEstimator(const MachineDescription& machine, double step_s);

  /// A new lift: forgets the updates so far, keeps the zero.
  void start() noexcept;
  /// The bucket is empty now: what the present lift says becomes zero for the next ones, and a new lift starts. Where
  /// the bucket was not lifted or lowered by 3 cm in this lift, sigma of all later loads includes what was zeroed,
  /// until a zero of a bucket that was.
  /// @return false where this lift has too few updates to say anything: then the zero stays as it is.
  [[nodiscard]] bool zero() noexcept;
  /// The sensors were away for a while: a way that was not seen is no lift, and no acceleration.
  void restart_motion() noexcept;
  void step(const JointState& state, const ForceEstimate& force) noexcept;

  [[nodiscard]] double kg() const noexcept { return kg_ - zero_kg_; }
  [[nodiscard]] double sigma_kg() const noexcept { return sigma_kg_; }
  /// The load while it is known well enough to be no contact, else fading to nothing: for ForceEstimator::carry().
  [[nodiscard]] const Load& carried() const noexcept { return carried_; }
  /// Something was touched since the bucket was last seen to be empty, or it is seen to be loaded: for
  /// ForceEstimator::hold_bias().
  [[nodiscard]] bool maybe_loaded() const noexcept { return maybe_loaded_; }

 private:
  static constexpr int kUnknowns = 9;  ///< m, d(m x), d(m z), constant[3], direction[3]
  using Information = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
  using Rows = Eigen::Matrix<double, kJoints, kUnknowns>;

  /// @return false without angles and at a cylinder's dead point: nothing can be weighed there.
  [[nodiscard]] bool follow_motion(const JointState& state, const ForceEstimate& force) noexcept;
  [[nodiscard]] Rows rows(const JointState& state, const ForceEstimate& force) const noexcept;
  [[nodiscard]] bool surprised(const Rows& rows, const JointVector& torque_Nm, const JointVector& variance) noexcept;
  void accumulate(const Rows& rows, const JointVector& torque_Nm, const JointVector& variance) noexcept;
  void solve(const ForceEstimate& force) noexcept;
  void judge_load(const ForceEstimate& force) noexcept;
  [[nodiscard]] bool known() const noexcept;
  void forget_way() noexcept;
  void forget_acceleration() noexcept;
  /// [0, 1]: 1 before this lift's updates have seen any way up or down, 0 once the usual place has moved by 3 cm.
  [[nodiscard]] double not_lifted() const noexcept;
  void carry() noexcept;

  LowPass<JointVector> acceleration_;  ///< Of the joints, as late as the external torque.
  JointVector last_rate_radps_ = JointVector::Zero();
  bool rate_known_ = false;                              ///< Whether the step before had a rate.
  JointVector inertia_Nm_per_kg_ = JointVector::Zero();  ///< Joint torques of one kilogram that is accelerated so.
  JointVector length_m_;
  PlanarVector usual_place_m_;
  double full_scale_kg_, step_s_;
  Information information_ = Information::Zero();
  Unknowns right_ = Unknowns::Zero();
  Unknowns unknowns_ = Unknowns::Zero();
  Information covariance_ = Information::Zero();
  JointVector surprise_ = JointVector::Zero();  ///< Running mean of normalised innovations.
  double height_m_ = 0;                         ///< Of the usual place above the boom's pin.
  double lowest_m_ = 0, highest_m_ = -1;        ///< Of it, over the updates of this lift; none yet.
  double squares_ = 0, updates_ = 0;
  double since_update_s_ = 0;
  double kg_ = 0, own_sigma_kg_ = 0, zero_kg_ = 0, zero_sigma_kg_ = 0;
  double weighed_sigma_kg_ = 0, sigma_kg_ = 0;  ///< Of kg(), before and after the doubt that it was lifted.
  Load carried_ = Load::Zero();
  bool bias_learned_ = false, maybe_loaded_ = false;
  double doubted_s_ = 0;
};

}  // namespace knuckle::estimation
