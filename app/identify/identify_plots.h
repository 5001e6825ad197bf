// The figures of an identification's report.
#pragma once

#include <vector>

#include "app/identify/identify.h"
#include "app/report/html.h"

namespace knuckle::identify {

/// Measured and modelled torque with residuals, one figure a held-out recording.
[[nodiscard]] std::vector<report::PageFigure> torque_figures(const IdentifyData& data, const Identified& result);
/// Friction over speed of each cylinder, with its uncertainty, beside the drawing's; none without a calibration.
[[nodiscard]] std::vector<report::PageFigure> friction_figures(const Identified& result);
/// What was identified from: joint angles and pressures over time, one figure a recording.
[[nodiscard]] std::vector<report::PageFigure> data_figures(const IdentifyData& data);

}  // namespace knuckle::identify
