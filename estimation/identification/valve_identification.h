// Valves from ordinary recordings of motion: dead bands, delay, flow gain of each axis.
#pragma once

#include <span>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

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
/// any dead band where the file has one.
[[nodiscard]] ValveResult identify_valves(const MachineDescription& machine, std::span<const Recording> recordings);

}  // namespace knuckle::estimation
