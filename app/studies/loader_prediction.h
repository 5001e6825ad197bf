// Speed of a loader's lift and tilt one second ahead, from what is known now.
#pragma once

#include <array>
#include <span>

#include "app/studies/loader_run.h"

namespace knuckle::studies {

/// RMS errors on test runs, of three ways that get the same data.
struct SpeedPrediction {
  double rmse_radps = 0;         ///< Boosted trees (XGBoost).
  double persistence_radps = 0;  ///< The speed stays as it is.
  double arx_radps = 0;          ///< Linear in lagged speeds, levers and every other channel, fitted for this horizon.
  std::size_t samples = 0;
};

inline constexpr double kPredictionHorizon_s = 1;

/// Fits on `train`, judges on `test`; every prediction uses the run up to its own moment alone, but for the levers over
/// the horizon where `levers_known` (then ARX gets them as well).
///
/// The trees see, per channel (speeds, angles, levers, cylinder forces, engine, axle, throttle, gear, digging), its
/// value now, its changes over 0.25 s and 1 s and its means over the last second and the one before; of the speeds also
/// means from 0.15 s to 4 s. That is what the physics asks for: the lever of the last 0.2 s has yet to act, ends of the
/// ranges stop the motion, load and engine scale it, levers are rectified by their dead bands - thresholds, which a
/// linear model cannot have.
[[nodiscard]] std::array<SpeedPrediction, kLoaderAxes> predict_speeds(std::span<const LoaderRun> train,
                                                                      std::span<const LoaderRun> test,
                                                                      bool levers_known);

}  // namespace knuckle::studies
