// Whole sessions for tests: a scenario from its file, changed in memory where a test asks for it, run to its end.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "app/session/metrics.h"
#include "app/session/session.h"
#include "machine/load.h"
#include "tests/support/no_alloc.h"

namespace knuckle::test {

/// A drawn machine, led over a link of a millisecond each way.
inline session::SessionSetup setup_of(const MachineDescription& machine, const std::string& device,
                                      const session::Scenario& scenario, std::uint64_t seed,
                                      sim::Family family = sim::Family::kSmooth) {
  session::SessionSetup setup;
  setup.machine = calibrated(machine);
  setup.device = load_device(find_config("device", device));
  setup.scenario = scenario;
  setup.truth = sim::sample_truth(machine, family, seed);
  setup.limb = sim::sample_limb(scenario.limb, seed);
  setup.to_machine.delay = setup.to_operator.delay = 1ms;
  setup.seed = seed;
  return setup;
}

/// What `knuckle simulate --scenario NAME --seed N` would run, as the scenario's file says.
inline session::SessionSetup session_setup(const std::string& scenario, std::uint64_t seed) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  return setup_of(machine, "knuckle1", session::load_scenario(find_config("scenario", scenario), machine), seed);
}

inline sim::Phase& phase_named(session::Scenario& scenario, const std::string& name) {
  const auto it = std::find(scenario.phase_names.begin(), scenario.phase_names.end(), name);
  if (it == scenario.phase_names.end()) throw std::invalid_argument("no phase " + name);
  return scenario.phases[static_cast<std::size_t>(it - scenario.phase_names.begin())];
}

struct FinishedSession {
  session::SessionRecord record;
  session::FrameLog frames;
  session::Metrics metrics;
  std::uint64_t allocations = 0;  ///< Of all steps together.
};

inline FinishedSession run_session(const session::SessionSetup& setup) {
  session::Session session(setup);
  FinishedSession finished;
  NoAllocScope scope;
  while (!session.done()) session.step();
  finished.allocations = scope.allocations();
  session::SessionOutcome outcome = session.take_outcome();
  finished.frames = std::move(outcome.frames);
  finished.record = std::move(outcome.record);
  finished.metrics = session::compute_metrics(finished.record);
  return finished;
}

/// A scenario: engage, move until something stops it, wait, engage anew and move again. @param faults [[fault]] tables,
/// in phase "moving" @param moving_s how long that is where nothing stops it
inline std::string broken_while_moving(const std::string& faults, int moving_s) {
  std::string text = R"(name = "broken_while_moving"
description = "Something fails while the machine moves."
reference_reach_m = 3.2
reference_payload_kg = 150
start_deg = [40, -75, -40]
hand_deg = [42, -77, -38]
duration_s = 60
[operator]
limb = "normal"
reaction_ms = 200
)";
  const std::string sweep = "kind = \"sweep\"\namplitude_deg = [8, 12, 16]\nperiod_s = [6, 5, 4.5]\n";
  const auto phase = [&text](const char* name, const std::string& rest) {
    text += std::string("[[phase]]\nname = \"") + name + "\"\n" + rest;
  };
  phase("engage", "kind = \"engage\"\n");
  phase("moving", sweep + "duration_s = " + std::to_string(moving_s) +
                      "\nuntil_fault = true\ntimeout_s = " + std::to_string(moving_s + 4) + "\n");
  phase("again", "kind = \"engage\"\n");
  phase("moving_again", sweep + "duration_s = 2\n");
  return text + faults;
}

/// That scenario for the machine of a file's text, with seed 1.
inline FinishedSession run_broken_while_moving(const MachineDescription& machine, const std::string& device,
                                               const std::string& faults, int moving_s) {
  const session::Scenario scenario = session::parse_scenario(broken_while_moving(faults, moving_s), "s.toml", machine);
  return run_session(setup_of(machine, device, scenario, 1));
}

/// The machine was stopped by the first fault, did not go on by itself, and was led again. @param about for messages
inline void expect_led_again(const FinishedSession& finished, const std::string& about) {
  EXPECT_EQ(finished.record.resumed_by_itself, 0) << about;
  EXPECT_EQ(finished.record.samples.back().phase, 3) << about << ": led again";
  EXPECT_EQ(finished.allocations, 0U) << about;
}

}  // namespace knuckle::test
