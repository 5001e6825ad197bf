// Knuckle's own identification: all nine base parameters and friction of all three cylinders together, from slow sweeps
// in both directions and fast motion.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimation/identification/excitation_check.h"
#include "estimation/identification/filtered_regressor.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/motion.h"
#include "estimation/identification/recording.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

/// One switch an ingredient. As they stand they are the method.
struct FullOptions {
  MotionOptions motion;        ///< Savitzky-Golay window and order; pressure lag to take off.
  RegressorOptions regressor;  ///< Pole, zero-phase triangle; Dahl state, Stribeck and load columns.
  bool friction = true;        ///< Friction columns at all.
  bool weighted = true;        ///< Rows by 1 / (sigma max(0.05 m, |lever|)), little near rest; else all alike.
  double huber = 2.5;          ///< 0: not robust.
  bool consistent = true;      ///< Nearest parameters that some arm could have, where the answer is outside.
  double cluster_s = 4;        ///< Errors within so long are taken as one for the sandwich covariance.
  ExcitationLimits limits;
  bool usual_errors = true;  ///< The summary's covariance with what usual_errors() change; 20 to 40 more fits.
  std::optional<CalibrationMatrix> model_error;  ///< Added to both covariances instead, where it is known.
};

struct FullResult {
  Identification summary;        ///< Parameters in the order of Calibration; covariance about the true ones.
  DynamicsCalibration dynamics;  ///< Covariance of the torques that this machine's own sensors make of them.
  int base_rank = 0;             ///< Of the nine base columns alone: 9 with motion, 6 at rest.
  CalibrationMatrix naive_covariance = CalibrationMatrix::Zero();     ///< As if rows were independent.
  CalibrationMatrix sandwich_covariance = CalibrationMatrix::Zero();  ///< Clustered; without model error.
  bool made_consistent = false;  ///< The least-squares answer was no possible arm and has been moved.
};

/// @param machine as calibrated(): geometry and encoder offsets are taken as known.
/// @return with summary.usable = false and the reasons where the recordings cannot tell (too short, constant, one
/// direction, ...) or the model does not explain them; parameters are then zero unless they could be solved for.
[[nodiscard]] FullResult identify_full(const MachineDescription& machine, std::span<const Recording> recordings,
                                       const FullOptions& options = {});

/// Measured and modelled joint torque: rigid body by the time derivative of the smoothed momentum, friction from the
/// calibration. Usable where the smoothing windows fit.
[[nodiscard]] TorqueComparison compare_torque(const DynamicsCalibration& dynamics, const MachineDescription& machine,
                                              const Recording& recording, const FullOptions& options = {});

/// "J1" ... "Z3", "boom F_c extend" ... in the order of Calibration.
[[nodiscard]] std::vector<IdentifiedParameter> calibration_names();

}  // namespace knuckle::estimation
