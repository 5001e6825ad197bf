// What `knuckle identify` works on: recordings to identify from and to validate with, read from files or driven on the
// simulated machine, checked and with the geometry of a survey.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/identify/commission.h"
#include "app/identify/identify_options.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"

namespace knuckle::identify {

// A survey as a table that a surveyor fills in: one pose a row. Format: docs/from-nothing-to-a-real-machine.md.

/// Columns `boom_encoder_m`, `arm_encoder_m`, `bucket_encoder_m` and, as pairs, any of `arm_pin_x_m`, `arm_pin_z_m`,
/// `bucket_pin_x_m`, ..., `tip_z_m`; in any order, each in m or, ending in `_mm`, in mm. An empty pair of cells is a
/// point that was not measured.
/// @param point_sigma_m standard deviation of one coordinate.
/// @throws InputError with file, row and column for anything else.
[[nodiscard]] estimation::Survey read_survey(const std::string& path, double point_sigma_m);

/// In m, to 0.01 mm; what read_survey reads.
void write_survey(const estimation::Survey& survey, std::ostream& out);

struct IdentifyData {
  MachineDescription machine;  ///< The drawing, with the survey's geometry where that is usable.
  std::optional<estimation::GeometryResult> geometry;
  std::vector<estimation::Recording> training, hold_out;
  std::vector<std::string> findings;    ///< Of files and data, one line each: "a.csv: ..."
  std::map<std::string, double> truth;  ///< By parameter name; of a simulated machine and the papers' methods only.
  std::string source, sha256;           ///< Of all bytes: recordings, hold-out, survey in the order given.
};

/// @throws InputError for files that cannot be read or recordings that cannot be what they say.
[[nodiscard]] IdentifyData read_data(const IdentifyOptions& options);

/// What --simulate drives, and every machine of an --ensemble.
[[nodiscard]] CommissionPlan commission_plan(const IdentifyOptions& options);

/// Surveys, excites and records the simulated machine through its wires; judged like files. Writes options.record.
/// For the papers' methods the motions are the papers'.
/// @param progress done share in [0, 1]; may throw to end it. @param posed called with the survey so far after each
/// pose.
[[nodiscard]] IdentifyData drive_for_data(const IdentifyOptions& options, const std::function<void(double)>& progress,
                                          const std::function<void(const estimation::Survey&)>& posed = {});

}  // namespace knuckle::identify
