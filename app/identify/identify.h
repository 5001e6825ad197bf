// `knuckle identify`: from checked recordings to a calibration, validated on motion that it has not seen.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/identify/baseline_report.h"
#include "app/identify/identify_data.h"
#include "app/identify/identify_options.h"
#include "app/identify/scores.h"
#include "estimation/identification/full.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/valve_identification.h"
#include "machine/description.h"

namespace knuckle::identify {

/// Starts pessimistic, as its summary does.
struct Identified {
  std::string method;
  estimation::Identification summary;
  std::vector<HoldOut> hold_out;                          ///< The method's first, then the papers' on the same data.
  std::vector<estimation::TorqueComparison> comparisons;  ///< The method's, one a held-out recording.
  std::optional<estimation::ValveResult> valves;          ///< Where recordings hold valve commands.
  std::vector<InertiaBias> bias;                          ///< For kMalaguti of simulated machines.
  std::vector<double> nominal;  ///< What the drawing says of each parameter; NaN where it says nothing.
  MachineDescription machine;   ///< With every calibration that is usable, and where it came from.
};

/// @param paper nothing: by the full method. @param options of the full method, such as an ensemble's model error.
/// @param progress done share in [0, 1]; may throw to end it.
[[nodiscard]] Identified identify(const IdentifyData& data, std::optional<Paper> paper,
                                  const estimation::FullOptions& options = {},
                                  const std::function<void(double)>& progress = {});

/// Reads or drives, identifies, writes the requested outputs. @return exit code: 0 usable; 1 not, or the machine did
/// not follow its commands.
/// @throws InputError for inputs and outputs that cannot be used.
int identify_command(const IdentifyOptions& options);

}  // namespace knuckle::identify
