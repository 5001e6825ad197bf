// What acts on the bucket by the contact model that was chosen, step by step: poses that the model refuses let its
// answer fade instead of jump, and it comes back only where it has answered for a while.
#pragma once

#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "estimation/contact_models.h"
#include "estimation/tip_force.h"
#include "machine/contact_model.h"
#include "machine/description_fwd.h"
#include "machine/planar_jacobian.h"

namespace knuckle::estimation {

/// One step's pose, as the models need it.
struct ContactPose {
  JointVector joints_rad = JointVector::Zero(), lever_m = JointVector::Zero();
  PlanarJacobian jacobian = PlanarJacobian::Zero();  ///< d tip / d joints in M.
  double hull_pitch_rad = 0;
  PlanarVector tip_mps = PlanarVector::Zero();
};

/// What the model says.
struct ContactAnswer {
  BucketLoad load;   ///< Of the model, as long as it answers; else its last one.
  double share = 0;  ///< [0, 1] of it that counts: 0 where the model has refused for kFade_s.
  /// Largest standard deviation of what the model says of the force. Where one torque has no say it is that of a force
  /// at the tip: how well the pose tells it, not where on the bucket it may act.
  double sigma_N = 0;
  std::optional<ContactRefusal> refusal;
};

class ContactForce {
 public:
  static constexpr double kFade_s = 0.2;              ///< From full to nothing, and back.
  static constexpr double kComeBack_s = 0.3;          ///< So long it must have answered ...
  static constexpr double kComeBackStrictness = 1.5;  ///< ... with so much room to what it refuses.
  static constexpr double kLeastMotion_mps = 0.02;    ///< Of the tip, for a direction of its own.
  static constexpr double kTurning_s = 0.2;           ///< Time constant of that direction.

  ContactForce(const MachineDescription& machine, double step_s) noexcept;

  [[nodiscard]] ContactModel model() const noexcept { return force_.contact_model; }
  [[nodiscard]] const BucketForceModel& bucket() const noexcept { return bucket_; }

  /// The sensors were away: the first answer counts at once.
  void restart() noexcept;
  /// One step. @param loaded_Nm the same torques with those of what is carried. @param covariance_Nm2 of both
  /// (torque_weight.h).
  void step(const ContactPose& pose, const JointVector& torque_Nm, const JointVector& loaded_Nm,
            const Eigen::Matrix3d& covariance_Nm2) noexcept;
  /// With a share that counts for both, and the reason of the one that is refused.
  [[nodiscard]] const ContactAnswer& answer() const noexcept { return answer_; }
  /// The force with what is carried.
  [[nodiscard]] PlanarVector loaded_N() const noexcept { return answer_.share * loaded_.answer.load.force_N; }

 private:
  struct Held {
    ContactAnswer answer;
    bool started = false, back = true;  ///< It counts, or is coming back.
    double answered_s = 0;
  };
  void follow(const ContactPose& pose) noexcept;
  void step(Held& held, const ContactPose& pose, const JointVector& torque_Nm,
            const Eigen::Matrix3d& covariance_Nm2) const noexcept;
  struct Found {
    BucketLoad load;
    double sigma_N = 0;
  };
  [[nodiscard]] OrRefusal<Found> solve(const ContactPose& pose, const JointVector& torque_Nm,
                                       const Eigen::Matrix3d& covariance_Nm2, double strictness) const noexcept;
  [[nodiscard]] OrRefusal<Found> along_direction(const JointLoad& load, double strictness) const noexcept;

  ForceDescription force_;
  JointVector length_m_;
  BucketForceModel bucket_;
  double step_s_;
  std::optional<PlanarVector> direction_;  ///< Frame M, unit, of the force.
  Held plain_, loaded_;
  ContactAnswer answer_;
};

}  // namespace knuckle::estimation
