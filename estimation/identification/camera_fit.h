// Where a camera on the machine is and what it looks at, from where the bucket's tip was seen in its picture in a few
// poses.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/joints.h"
#include "machine/description.h"

namespace knuckle::estimation {

/// The tip as seen once.
struct TipSight {
  PlanarVector tip_m = PlanarVector::Zero();        ///< Frame M, as measured.
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< From the picture's upper left corner, y down.
};

inline constexpr std::size_t kLeastTipSights = 6;  ///< Four would do for six unknowns, and would hide any mistake.

struct CameraFit {
  CameraDescription camera;
  double rms_px = 0;                ///< Of the distances from what was clicked to where the fit sees the tip.
  std::vector<double> residual_px;  ///< The same of each.
  double drawn_sd_px = 0;  ///< How well what is drawn over the picture will fit: the largest standard deviation of
                           ///< where the tip is seen, anywhere it reaches, for clicks as good as these.
  std::string refused;     ///< Why it must not be used, and what to do; empty: it may.
};

/// Least squares of six unknowns (position, pan, tilt, field of view; no roll and no distortion, as CameraDescription
/// has it), by Ceres from several starts, of which `start` is one. @param width_px, @param height_px of the picture.
/// @param reach_m of the machine. Refused: too few sights, sights that do not tell the unknowns apart (all near each
/// other, or along a line), that contradict each other, or of which follows that the camera sees nowhere that the tip
/// works.
[[nodiscard]] CameraFit fit_camera(const std::vector<TipSight>& sights, const CameraDescription& start, int width_px,
                                   int height_px, double reach_m);

/// The block of a machine's file. @param fit not refused.
[[nodiscard]] std::string camera_block(const CameraFit& fit);

}  // namespace knuckle::estimation
