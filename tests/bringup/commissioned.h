// A whole commissioning of a simulated machine by answers.
#pragma once

#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "app/bringup/commission_result.h"
#include "app/bringup/commission_wizard.h"
#include "machine/load.h"
#include "tests/bringup/commission_script.h"
#include "tests/bringup/hardware_bench.h"

namespace knuckle::bringup::test {

struct Outcome {
  std::string ended;  ///< Empty where it came to its end.
  std::string told;
  WizardResult result;
  double moved_m = 0;  ///< Any cylinder.
  bool left_neutral = false;
};

/// @param meddle before it begins, and every millisecond
inline Outcome commission(const MachineDescription& truth, const MachineDescription& file, Script script,
                          const std::function<void(sim::MachineOnBus&)>& meddle = {}) {
  const auto bus = simulated_bus(truth, 7);
  Outcome outcome;
  const JointVector before_m = bus->plant().cylinder_m;
  if (meddle) meddle(*bus);
  bus->each_tick = [&](sim::MachineOnBus& b) {
    outcome.moved_m = std::max(outcome.moved_m, (b.plant().cylinder_m - before_m).cwiseAbs().maxCoeff());
    if (meddle) meddle(b);
  };
  BusAccess access = sim::access_to(bus);
  const auto next = lines_of(script);
  std::ostringstream told;
  const auto record = [](const MachineDescription&, const std::function<bool()>&) {
    return std::vector<std::string>();
  };
  try {
    outcome.result = run_wizard(file, access, terminal(told, next, false), record, [] {});
  } catch (const CommissionEnded& ended) {
    outcome.ended = ended.what();
  }
  outcome.told = told.str();
  outcome.left_neutral =
      bus->machine().nodes().outputs().spool_demand == JointVector::Zero() && !bus->machine().nodes().outputs().pilot;
  bus->each_tick = {};
  return outcome;
}

/// The text with `to` in place of the first `from`; empty where it has none.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  return at == std::string::npos ? "" : text.replace(at, from.size(), to);
}
inline MachineDescription machine_of(const std::string& text) {
  return parse_machine(text, "m.toml");
}

}  // namespace knuckle::bringup::test
