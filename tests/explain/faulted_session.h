// A short session on virtual time in which one thing breaks, recorded to a file.
#pragma once

#include <string>

#include "tests/recording/recorded_session.h"

namespace knuckle::explain {

/// Engages and moves all joints for length_s; the fault comes after_s into that. @param fault its lines in a scenario,
/// without phase and after_s; empty: nothing breaks.
inline std::string faulted_scenario(const std::string& fault, double after_s, double length_s) {
  std::string text =
      "name = \"faulted\"\ndescription = \"One thing breaks.\"\nreference_reach_m = 3.2\nreference_payload_kg = 150\n"
      "start_deg = [40, -75, -40]\nhand_deg = [42, -77, -38]\nduration_s = 60\n"
      "[operator]\nlimb = \"normal\"\nreaction_ms = 200\n"
      "[[phase]]\nname = \"engage\"\nkind = \"engage\"\n"
      "[[phase]]\nname = \"move\"\nkind = \"sweep\"\namplitude_deg = [8, 12, 16]\nperiod_s = [6, 5, 4.5]\n";
  text += "duration_s = " + std::to_string(length_s) + "\n";
  text +=
      "[[phase]]\nname = \"recover\"\nkind = \"engage\"\n[[phase]]\nname = \"wait\"\nkind = \"wait\"\nduration_s = "
      "0.5\n";
  if (!fault.empty()) text += "[[fault]]\nphase = \"move\"\nafter_s = " + std::to_string(after_s) + "\n" + fault + "\n";
  return text + "[[criteria]]\nmetric = \"resumed_by_itself\"\nmax = 0\n";
}

/// Runs it to its end. @param flights folder of flight records; empty: none.
inline void record_session(const std::string& scenario, const std::string& file, const std::string& flights = "") {
  session::SimulateOptions options;
  options.scenario = "faulted";
  options.scenario_text = scenario;
  recording::RecorderOptions how;
  how.file = file;
  how.folder = flights;
  test::record(options, how);
}

}  // namespace knuckle::explain
