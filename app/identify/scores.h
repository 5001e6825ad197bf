// How near identified parameters are to the simulated machine's, and whether their intervals say so.
#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "app/identify/commission.h"
#include "core/joints.h"
#include "estimation/identification/identification.h"
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

// The one rule by which a result of identification is usable: `knuckle identify`, its pages and the battery ask here.

/// Torque of one held-out recording as one method models it.
struct HoldOut {
  std::string source, method;
  estimation::TorqueFit to_2Hz, unfiltered;
  /// RMS [N] of the tip force that a paper's method finds in it, as a force alone and as a force with a torque; with an
  /// empty bucket in the air that is its error. NaN where the method has no such force.
  double tip_force_N = std::numeric_limits<double>::quiet_NaN(), tip_wrench_N = tip_force_N;
  /// Rests are too short for the filter.
  [[nodiscard]] bool filtered() const { return to_2Hz.nrmse.array().isFinite().any(); }
  [[nodiscard]] const estimation::TorqueFit& judged() const { return filtered() ? to_2Hz : unfiltered; }
};

/// RMS of tip forces (x, z, and whatever follows), of those that are known; NaN where none is.
template <typename Vectors>
[[nodiscard]] double force_rms_N(const Vectors& forces) {
  double sum = 0, count = 0;
  for (const auto& force : forces) {
    if (!force.allFinite()) continue;
    sum += force.template head<2>().squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : std::numeric_limits<double>::quiet_NaN();
}

/// @param source names the recording, `method` the model that was compared with it.
[[nodiscard]] HoldOut held_out(const std::string& source, const std::string& method,
                               const estimation::TorqueComparison& comparison);

/// Of a joint's held-out torque, NRMSE as judged(); beyond it the model explains another machine.
inline constexpr double kWorstNrmse = 0.25;

/// What held-out motion says against one method's result, one line each: a joint of which more than kWorstNrmse is left
/// unexplained, or nothing to judge by. Empty: usable.
/// @param must_be_judged joints that the method models, so that some recording must have judged them (the papers'
/// leave some out, and a cylinder without transmitters has no torque to compare with).
[[nodiscard]] std::vector<std::string> objections(std::span<const HoldOut> held, const PerJoint<bool>& must_be_judged);

}  // namespace knuckle::identify
