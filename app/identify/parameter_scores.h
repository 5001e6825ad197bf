// How near identified parameters are to the simulated machine's, and whether their intervals say so.
#pragma once

#include "app/identify/commission.h"
#include "machine/calibration.h"
#include "machine/description.h"

namespace knuckle::identify {

/// What the parameters of this model should be on this machine. Base parameters: projection of the simulator's torques
/// on the regressor over the hold-out (cylinder masses have no place of their own in it). Friction: least squares of
/// the simulator's friction, with what transmitters and hoses add to it, on the model's own columns.
/// @param machine with the geometry that was identified with; @param found gives v_s.
/// @param hull_pitch_rad the true one: what the slope sensor is off counts as an error.
[[nodiscard]] CalibrationVector true_parameters(const MachineDescription& machine, const CommissionRuns& runs,
                                                const DynamicsCalibration& found, double hull_pitch_rad);

/// Relative errors, per joint.
struct ParameterScores {
  JointVector gravity = JointVector::Zero();   ///< |(X, Z) error| / |(X, Z)|
  JointVector inertia = JointVector::Zero();   ///< |J error| / J
  JointVector friction = JointVector::Zero();  ///< F_f(v): RMS error / RMS over the speeds driven, means removed
  int intervals = 0, covered = 0;              ///< Base parameters whose 95 % interval holds the truth.
};

/// @param covariance about the true parameters, of which the base parameters' intervals are made.
[[nodiscard]] ParameterScores score_parameters(const MachineDescription& machine, const CommissionRuns& runs,
                                               const DynamicsCalibration& found, const Eigen::MatrixXd& covariance,
                                               double hull_pitch_rad);

}  // namespace knuckle::identify
