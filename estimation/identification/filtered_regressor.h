// The acceleration-free filtered regressor over a whole recording: what `full` solves and what it is judged by.
//
//   F tau = a (P - F P) Phi - a e^{-at} P(0) Phi + F (V + G) Phi + F (r f) ,  F(s) = a / (s + a)
//
// in relative joints (rows tau): P, V, G the momentum, velocity-product and gravity columns of estimation/regressor.h,
// r the lever and f the friction columns of the joint's own cylinder.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/motion.h"
#include "estimation/regressor.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

struct FrictionColumns {
  bool dahl = true;             ///< Bristle state; else the sign of the speed.
  bool settle = true;           ///< The bristles come loose where the rod stands.
  bool stribeck = true;         ///< Column of kBreakaway, else 0.
  bool load = true;             ///< Column of kLoadShare, else 0.
  bool seal = true;             ///< Column of kSeal, else 0.
  double stribeck_mps = 0.012;  ///< v_s
};

/// Friction per unit of the six parameters (order of FrictionIndex) in every sample: row 6 i + k for cylinder i.
/// Within a stretch the bristle starts relaxed; `known` says from 0 to 1 how far it has come to know its state.
struct FrictionSignals {
  Eigen::MatrixXd columns;  ///< 18 x samples [1] or [m/s] or [N] or [Pa]
  Eigen::Matrix3Xd known;
};
[[nodiscard]] FrictionSignals friction_signals(const Motion& motion, const FrictionColumns& options);

struct RegressorOptions {
  double pole_Hz = 2;       ///< a / (2 pi)
  double triangle_s = 0.2;  ///< Each of two zero-phase boxes over right side and columns; 0: none.
  FrictionColumns friction;
};

/// One column a sample, NaN outside `stretches`.
struct FilteredRegressor {
  double step_s = 0;
  std::vector<Stretch> stretches;
  Eigen::MatrixXd base;      ///< 27 x samples: row 9 i + j is column j of joint i.
  Eigen::MatrixXd friction;  ///< 18 x samples: row 6 i + k, lever included [N m per unit].
  Eigen::Matrix3Xd right;    ///< Filtered cylinder torque [N m].
  Eigen::Matrix3Xd trust;    ///< [0, 1]: share of the filters' memory in which friction is known (not near rest).
};

[[nodiscard]] FilteredRegressor filtered_regressor(const RigidArm& arm, const Motion& motion,
                                                   const RegressorOptions& options = {});

// The nine base parameters that explain given torques best: what an identification is held against when the torques
// come from something that is not exactly such an arm (cylinders and linkage have mass, too).

struct DynamicState {
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero(), joint_radps2 = JointVector::Zero();
  double hull_pitch_rad = 0;
  JointVector lever_m = JointVector::Zero();  ///< For the weight 1 / max(kLeastSureLever_m, |lever|), as `full` weighs.
  JointVector joint_Nm = JointVector::Zero();  ///< What moves the links: cylinder force less friction, times lever.
};

/// Weighted least squares over the samples in relative joints. @param machine gives the link lengths.
/// @throws std::invalid_argument where the samples do not determine all nine (rest).
[[nodiscard]] BaseParameters project(const MachineDescription& machine, const std::vector<DynamicState>& samples);

/// Weight of a joint's rows by its lever: sensor and friction errors live in the cylinder.
[[nodiscard]] inline double lever_weight(double lever_m) noexcept {
  const double arm = lever_m < 0 ? -lever_m : lever_m;
  return 1 / (arm > kLeastSureLever_m ? arm : kLeastSureLever_m);
}

}  // namespace knuckle::estimation
