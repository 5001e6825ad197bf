// Valves from ordinary recordings of motion: dead bands, delay, flow gain of each axis.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "machine/calibration.h"
#include "machine/description.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

// A valve and its cylinder as one axis of a recording shows them: the model that valve_identification fits.

/// Openings are parts of the spool's stroke, the delay is in s, the gain in m^3/s, offsets of pressures in Pa.
enum ValveParameter {
  kDeadExtend,
  kDeadRetract,
  kDelay,
  kGain,
  kHeadOffset,
  kRodOffset,
  kExponent,
  kRetractShare,
  kNotchOpening,
  kNotchSlope,
  kAll
};
inline constexpr int kStraight = kExponent, kCurved = kNotchOpening;  ///< So many without a curve, and without a notch.
using ValveVector = Eigen::Matrix<double, kAll, 1>;

[[nodiscard]] ValveVector valve_vector(const ValveDescription& file);  ///< Offsets zero.
[[nodiscard]] ValveCalibration valve_calibration(const ValveVector& parameters);

/// What one axis shows over one stretch of a recording without gaps.
struct AxisStretch {
  double step_s;
  std::vector<double> command, length_m, head_Pa, rod_Pa;
  /// Without transmitters: pressures with which the cylinder would let its oil out while it carries the arm's weight,
  /// as the machine's law takes them (slave/joint_control.h). Nothing is known of how they change within a stroke.
  bool weighed = false;
  std::vector<double> spool;         ///< Where the commands put it, but for the delay.
  std::vector<double> measured_mps;  ///< Filtered speed of the encoder.
};

/// @param machine as calibrated(): its parameters weigh the arm where a cylinder has no transmitters.
/// @return all stretches of the recordings in which the axis' command is known, but those too short to tell anything.
[[nodiscard]] std::vector<AxisStretch> axis_stretches(const MachineDescription& machine,
                                                      std::span<const Recording> recordings, int joint);

inline constexpr double kValveSettle_s = 0.5;  ///< Until the spool's past before a stretch is forgotten.
inline constexpr double kValveEvery_s = 0.05;  ///< Of the filtered speeds below.

/// Filtered speed of encoder and model every kValveEvery_s, where both are known, and the least drop it went by.
struct AxisSpeeds {
  std::vector<double> measured_mps, modelled_mps, least_drop_Pa;
};

class AxisModel {
 public:
  AxisModel(const MachineDescription& machine, std::size_t joint)
      : cylinder_(machine.cylinders[joint]), hydraulics_(machine.hydraulics) {}

  [[nodiscard]] AxisSpeeds speeds(const AxisStretch& axis, const ValveVector& parameters) const;

 private:
  /// Speed of the rod at every sample, NaN-free; the drop it went by in `drop_Pa`.
  [[nodiscard]] std::vector<double> speed_mps(const AxisStretch& axis, const ValveVector& p,
                                              std::vector<double>& drop_Pa) const;
  /// Oil that the return side takes up as its pressure rises [m^3/s].
  [[nodiscard]] double compression(const AxisStretch& axis, std::size_t i, bool extends) const;

  CylinderDescription cylinder_;
  HydraulicsDescription hydraulics_;
};

struct ValveResult {
  /// Parameters per axis: dead_band_extend, dead_band_retract, delay, nominal_flow, the offsets of the two pressures,
  /// which lean on zero, and where a curve was needed its curve_exponent and retract_share, and where a notch
  /// explains much more its notch_opening and notch_slope. `reasons` also says how far
  /// commands went.
  PerJoint<Identification> axes;
  PerJoint<ValveCalibration> valves{};  ///< The machine file's values where an axis is not usable.
};

/// A cylinder's speed is what its return edge lets out. With the spool x behind the command (delay, hysteresis, second
/// order) and the port's pressure p_out measured,
///   A_out v = K s(x) sqrt(p_out - p_tank) + V / beta dp_out/dt,  s: ValveDescription::flow_share(),
/// needs neither the supply pressure, which no one measures, nor the load. Dead bands, delay and K are fitted such that
/// the filtered speed of model and encoder agree (Ceres, Huber loss); pressure offsets have a prior of +- 0.6 bar. A
/// curve, and another flow where it retracts, are fitted only where straight edges miss the speed, a notch only where
/// it explains much more than the curve alone. The
/// spool's frequency and hysteresis are the file's: hysteresis below the controller's dither does not show, and a
/// slower spool looks like a longer delay, which sigma allows for. Saturation does not show before commands reach it.
/// @param recordings with valve commands; where an axis' command is NaN, that axis is not fitted. An axis is refused,
/// with the reason, that did not move at 5 mm/s or more for 2 s each way, or whose fit does not hold or has hardly
/// any dead band where the file has one. A cylinder without transmitters is fitted to the flow at the load that the
/// arm's weight makes, with straight edges: a curve would take up what that load is off.
[[nodiscard]] ValveResult identify_valves(const MachineDescription& machine, std::span<const Recording> recordings);

}  // namespace knuckle::estimation
