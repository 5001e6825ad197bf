// An identification for people at a terminal and for tools.
#pragma once

#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/output_file.h"
#include "app/identify/identify.h"
#include "app/report/html.h"
#include "machine/description_fwd.h"

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

// A calibrated machine file: the machine file as it was, comments and all, with what was found out behind it.

/// @param machine_file text of a machine file; [calibration] tables of an earlier calibration are left out.
/// @param machine its provenance and whichever other calibrations it has are written. Numbers keep all their digits.
/// @throws InputError where the result, read back, is refused: a calibration that no machine can have.
[[nodiscard]] std::string calibrated_machine_text(std::string_view machine_file, const MachineDescription& machine);

/// Writes it from machine.source. A file already there is kept: FILE.toml as FILE.N.toml, the next free number. At any
/// moment the target is the old file or the new one, whole.
/// @return where the old one was kept; empty if there was none.
/// @param file opened before the work is done, so that a bad place is known then.
/// @throws InputError naming the file that cannot be read or written.
std::string write_calibrated_machine(const MachineDescription& machine, cli::OutputFile& file);

}  // namespace knuckle::identify
