// Knuckle's own identification: all nine base parameters and friction of all three cylinders together, from slow sweeps
// in both directions and fast motion.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/filtered_regressor.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/motion.h"
#include "estimation/identification/recording.h"
#include "machine/calibration.h"
#include "machine/description.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

// Whether recordings can tell anything: the refusals of identification, each one line with its number.

/// @return reasons why these recordings cannot be used, empty if none.
[[nodiscard]] std::vector<std::string> excitation_faults(std::span<const Recording> recordings,
                                                         std::span<const Motion> motions);

// Parameters that some arm of steel could have: the pseudo-inertia of each link, carrying the later links at its end,
//   [[J, X, Z], [X, M, 0], [Z, 0, M]] >= 0   <=>   J M >= X^2 + Z^2,  M > 0,  M = sum of m_k for k >= i,
// with M no more than the machine file's masses allow, and no cylinder whose viscosity, Coulomb friction (the mean of
// both directions: half their difference is a transmitter's error) or static friction drives it.

/// Greatest M_i: links, cylinders and linkage from joint i on, a quarter more than the machine file says.
[[nodiscard]] JointVector greatest_mass_kg(const MachineDescription& machine);

[[nodiscard]] bool physically_consistent(const CalibrationVector& parameters, const JointVector& greatest_kg) noexcept;

/// The consistent parameters p nearest to `free` in the metric of the data, (p - free)^T information (p - free).
/// Parameters without any information stay as they are. Ceres on J = (X^2 + Z^2) / M + d^2 and the like.
[[nodiscard]] CalibrationVector nearest_consistent(const CalibrationVector& free, const CalibrationMatrix& information,
                                                   const JointVector& greatest_kg);

/// One switch an ingredient. As they stand they are the method.
struct FullOptions {
  MotionOptions motion;        ///< Savitzky-Golay window and order; pressure lag to take off.
  RegressorOptions regressor;  ///< Pole, zero-phase triangle; Dahl state, Stribeck and load columns.
  bool friction = true;        ///< Friction columns at all.
  bool weighted = true;      ///< Rows by 1 / (sigma max(kLeastSureLever_m, |lever|)), little near rest; else all alike.
  double huber = 2.5;        ///< 0: not robust.
  bool consistent = true;    ///< Nearest parameters that some arm could have, where the answer is outside.
  double cluster_s = 4;      ///< Errors within so long are taken as one for the sandwich covariance.
  bool usual_errors = true;  ///< The summary's covariance with what usual_errors() change; 20 to 40 more fits.
  std::optional<CalibrationMatrix> model_error;  ///< Added to both covariances instead, where it is known.
};

struct FullResult {
  Identification summary;        ///< Parameters in the order of Calibration; covariance about the true ones.
  DynamicsCalibration dynamics;  ///< Covariance of the torques that this machine's own sensors make of them.
  CalibrationMatrix sandwich_covariance = CalibrationMatrix::Zero();  ///< Clustered; without model error.
  bool made_consistent = false;  ///< The least-squares answer was no possible arm and has been moved.
};

/// Columns of Calibration that no torque of this machine holds: where nobody measures a cylinder's pressures its
/// friction, and of the boom also its inertia and moments, which reach no other joint. Full machines: none.
[[nodiscard]] std::vector<int> unseen_columns(const MachineDescription& machine);

/// What the drawing says of all parameters; NaN where it says nothing (load share and friction of seals).
[[nodiscard]] CalibrationVector drawn_parameters(const MachineDescription& machine);

/// @param machine as calibrated(): geometry and encoder offsets are taken as known. Its unseen_columns() keep the
/// drawing's values and how far a drawing may be off.
/// @return with summary.usable = false and the reasons where the recordings cannot tell (too short, constant, one
/// direction, ...) or the model does not explain them; parameters are then zero unless they could be solved for.
[[nodiscard]] FullResult identify_full(const MachineDescription& machine, std::span<const Recording> recordings,
                                       const FullOptions& options = {});

/// Measured and modelled joint torque: rigid body by the time derivative of the smoothed momentum, friction from the
/// calibration. Usable where the smoothing windows fit; NaN for a cylinder without transmitters.
[[nodiscard]] TorqueComparison compare_torque(const DynamicsCalibration& dynamics, const MachineDescription& machine,
                                              const Recording& recording, const FullOptions& options = {});

// What no residual of a fit can show: errors of sensors, lengths and the model that the parameters take up. Found by
// identifying the same recordings again with one of them at a time put on (type B uncertainties of JCGM 100:2008, 4.3;
// for the model, an allowance of ours).

/// All that `full` identifies from.
struct FullInput {
  MachineDescription machine;  ///< As calibrated().
  std::vector<Recording> recordings;
  FullOptions options;
};

struct UsualError {
  enum class Of : std::uint8_t {
    kInput,  ///< A sensor or a length.
    kModel,  ///< The friction law or the weights. What friction parameters mean changes with it: only the base counts.
  } of;
  std::string name;                       ///< "gain of boom pressure A"
  std::function<void(FullInput&)> apply;  ///< Puts one standard deviation of it on; of kModel, all of it.
};

/// Transmitter gains and lag, slope sensor, compliance behind the encoders where the cylinder's force is measured;
/// lengths, which a survey has made smaller; each term of the friction law the other way; rows weighted otherwise.
/// Offsets of transmitters are not among them: they are constant forces, which friction parameters take up. @param
/// machine as calibrated().
[[nodiscard]] std::vector<UsualError> usual_errors(const MachineDescription& machine);

/// "J1" ... "Z3", "boom F_c extend" ... in the order of Calibration.
[[nodiscard]] std::vector<IdentifiedParameter> calibration_names();

}  // namespace knuckle::estimation
