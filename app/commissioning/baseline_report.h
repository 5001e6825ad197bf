// The papers' results again, on data of ours: their tables and figures in their layout, as one HTML page a method.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "app/commissioning/baseline_runs.h"
#include "estimation/identification/kim.h"
#include "estimation/identification/malaguti.h"
#include "estimation/identification/static_poses.h"

namespace knuckle::app {

struct BaselineData {
  std::vector<estimation::Recording> identification;
  std::vector<estimation::Recording> verification;  ///< Not identified with; may be empty.
  std::map<std::string, double> truth;              ///< By parameter name, of a simulated machine; else empty.
};

/// Table 1 of M, and the torques of every pose.
/// @throws InputError where the file cannot be written or gnuplot is missing; likewise below.
void write_baseline_report(const std::string& path, const MachineDescription& machine,
                           const estimation::StaticResult& result, const BaselineData& data);

/// Tables 2 and 3, figures 3 and 4 of M (of the first verification run, or of the identification's where there is
/// none), beside the same with a slower filter and a longer window.
/// @param bias what malaguti_bias found; empty: left out.
void write_baseline_report(const std::string& path, const MachineDescription& machine,
                           const estimation::MalagutiResult& result, const BaselineData& data,
                           const std::vector<InertiaBias>& bias = {});

/// Table 1, figures 4 to 8 of K.
void write_baseline_report(const std::string& path, const MachineDescription& machine,
                           const estimation::KimResult& result, const BaselineData& data);

}  // namespace knuckle::app
