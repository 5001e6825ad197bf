// A whole commissioning of a simulated machine by answers.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/bringup/commission_wizard.h"
#include "app/bringup/planned_faults.h"
#include "app/cli/interrupt.h"
#include "tests/bringup/commission_script.h"
#include "tests/bringup/hardware_bench.h"

namespace knuckle::bringup::test {

struct Outcome {
  std::string ended;  ///< Empty where it came to its end.
  std::string told;
  WizardResult result;
  double moved_m = 0;    ///< The furthest of all cylinders.
  bool powered = false;  ///< At any time.
  bool left_neutral = false;
};

/// Whether it came to its end and found nothing wrong.
inline testing::AssertionResult well(const Outcome& outcome) {
  if (outcome.ended.empty() && healthy(outcome.result.findings)) return testing::AssertionSuccess();
  return testing::AssertionFailure() << outcome.ended << "\n" << outcome.told;
}

/// @param change of the access, before it begins. @param check may throw to interrupt it.
inline Outcome commission(
    const std::shared_ptr<sim::MachineOnBus>& bus, Script script, const MachineDescription& file = solar(),
    const std::function<void(BusAccess&)>& change = {}, const Resume& resume = {},
    const std::function<void()>& check = [] {}) {
  Outcome outcome;
  const auto meddle = std::move(bus->each_tick);
  bus->each_tick = [&, before_m = JointVector(bus->plant().cylinder_m)](sim::MachineOnBus& b) {
    outcome.powered = outcome.powered || b.machine().nodes().outputs().pilot;
    outcome.moved_m = std::max(outcome.moved_m, (b.plant().cylinder_m - before_m).cwiseAbs().maxCoeff());
    if (meddle) meddle(b);
  };
  BusAccess access = sim::access_to(bus);
  if (change) change(access);
  const auto next = lines_of(script);
  std::ostringstream told;
  const auto record = [](const MachineDescription&, const std::function<bool()>&) {
    return std::vector<std::string>();
  };
  try {
    outcome.result = run_wizard(file, access, terminal(told, next, false), record, check, resume);
  } catch (const CommissionEnded& ended) {
    outcome.ended = ended.what();
  } catch (const cli::Interrupted& ended) {
    outcome.ended = ended.what();
  }
  outcome.told = told.str();
  const sim::NodeOutputs outputs = bus->machine().nodes().outputs();
  outcome.left_neutral = outputs.spool_demand == JointVector::Zero() && !outputs.pilot;
  bus->each_tick = meddle;
  return outcome;
}

/// @param truth as the machine really is. @param meddle before it begins, and every millisecond.
inline Outcome commission(const MachineDescription& truth, const MachineDescription& file, Script script,
                          const std::function<void(sim::MachineOnBus&)>& meddle = {}) {
  const auto bus = simulated_bus(truth, 7);
  if (meddle) meddle(*bus);
  bus->each_tick = meddle;
  return commission(bus, std::move(script), file);
}

/// Of the shipped machine, with a fault as it is given with --fault.
inline Outcome commission_with(const std::string& fault, Script script = all()) {
  const auto bus = simulated_bus();
  bus->each_tick = [faults = NodeFaults({parse_fault(fault, solar().bus)}, solar().bus)](sim::MachineOnBus& b) mutable {
    faults.step(b.now(), 0, b, [](const FaultEvent&) {});
  };
  return commission(bus, std::move(script));
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
