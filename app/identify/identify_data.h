// What `knuckle identify` works on: recordings to identify from and to validate with, read from files or driven on the
// simulated machine, checked and with the geometry of a survey.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/identify/commission.h"
#include "app/identify/identify_options.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"

namespace knuckle::identify {

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
