// An identification for people at a terminal and for tools.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/identify/identify.h"
#include "app/report/html.h"

namespace knuckle::identify {

[[nodiscard]] std::string identify_summary(const IdentifyData& data, const Identified& result);

/// Keys: docs/identification.md.
void write_identify_json(const IdentifyData& data, const Identified& result, std::ostream& out);

/// "usable", or "usable: no" with the first reason.
[[nodiscard]] std::string verdict(const Identified& result);

/// Whether standard deviations can be believed.
[[nodiscard]] std::string sigma_text(const Identified& result);

// The figures of an identification's report.

/// Measured and modelled torque with residuals, one figure a held-out recording.
[[nodiscard]] std::vector<report::PageFigure> torque_figures(const IdentifyData& data, const Identified& result);
/// Friction over speed of each cylinder, with its uncertainty, beside the drawing's; none without a calibration.
[[nodiscard]] std::vector<report::PageFigure> friction_figures(const Identified& result);
/// What was identified from: joint angles and pressures over time, one figure a recording.
[[nodiscard]] std::vector<report::PageFigure> data_figures(const IdentifyData& data);

// One self-contained HTML page about an identification: verdict, measured against estimated torque, residuals,
// parameters against the drawing, friction, geometry, held-out errors, what was found in the data.

/// @throws InputError where gnuplot fails.
void write_identify_report(const IdentifyData& data, const Identified& result, std::ostream& out);

// Recordings and comparisons as series to be plotted, kUnknown where a sample is not usable.

/// Of each of `count` rows, from 0 on.
[[nodiscard]] std::vector<double> times(std::size_t count, double step_s);
/// @param values of the comparison, in units of `unit_Nm`.
[[nodiscard]] std::vector<double> torque_series(const estimation::TorqueComparison& comparison,
                                                const std::vector<JointVector>& values, int joint, double unit_Nm = 1);
/// Angle of a joint and the pressures of its cylinder.
struct JointSeries {
  std::vector<double> t_s, angle_deg, head_bar, rod_bar;
};
[[nodiscard]] JointSeries joint_series(const MachineDescription& machine, const estimation::Recording& recording,
                                       int joint);
[[nodiscard]] double total_s(const std::vector<estimation::Recording>& recordings);

}  // namespace knuckle::identify
