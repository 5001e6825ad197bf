// A valve and its cylinder as one axis of a recording shows them: the model that valve_identification fits.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "estimation/identification/recording.h"
#include "machine/calibration.h"
#include "machine/description.h"

namespace knuckle::estimation {

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
};

/// @return all stretches of the recordings in which the axis' command is known, but those too short to tell anything.
[[nodiscard]] std::vector<AxisStretch> axis_stretches(std::span<const Recording> recordings, int joint);

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
  [[nodiscard]] std::vector<double> spool_without_delay(const AxisStretch& axis) const;
  /// Oil that the return side takes up as its pressure rises [m^3/s].
  [[nodiscard]] double compression(const AxisStretch& axis, std::size_t i, bool extends) const;

  CylinderDescription cylinder_;
  HydraulicsDescription hydraulics_;
};

}  // namespace knuckle::estimation
