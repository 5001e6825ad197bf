// The papers' results again, on data of ours: their tables and figures in their layout, as one HTML page a method.
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "app/identify/baseline_runs.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"

namespace knuckle::identify {

struct BaselineData {
  std::vector<estimation::Recording> identification;
  std::vector<estimation::Recording> verification;  ///< Not identified with; may be empty.
  std::map<std::string, double> truth;              ///< baseline_truth of a simulated machine; else empty.
  std::vector<InertiaBias> bias;                    ///< malaguti_bias, for "malaguti"; empty: left out.
  estimation::Identification verdict{};             ///< As `knuckle identify` judged it: usable, and why not.
};

/// Identifies by `method` with the authors' settings and writes the page:
/// "static": table 1 of M (for all three links) and the torques of every pose.
/// "malaguti": tables 2 and 3, figures 3 and 4 of M, beside the same with a slower filter and a longer window.
/// "kim": table 1, figures 4 to 8 of K.
/// Figures 3 and 4 are of the first verification, figure 8 of the last, or of the identification where there is none.
/// @param machine as calibrated().
/// @throws InputError for another method, or where gnuplot is missing.
void write_baseline_report(const std::string& method, const MachineDescription& machine, const BaselineData& data,
                           std::ostream& out);

}  // namespace knuckle::identify
