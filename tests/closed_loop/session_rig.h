// Whole sessions for tests: a scenario from its file, changed in memory where a test asks for it, run to its end.
#pragma once

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "app/session/metrics.h"
#include "app/session/session.h"
#include "machine/load.h"
#include "tests/support/no_alloc.h"

namespace knuckle::test {

/// What `knuckle simulate --scenario NAME --seed N` would run, as the scenario's file says.
inline session::SessionSetup session_setup(const std::string& scenario, std::uint64_t seed) {
  session::SessionSetup setup;
  setup.machine = load_machine(find_config("machine", "solar015"));
  setup.device = load_device(find_config("device", "knuckle1"));
  setup.scenario = session::load_scenario(find_config("scenario", scenario), setup.machine);
  setup.truth = sim::sample_truth(setup.machine, seed);
  setup.machine = calibrated(setup.machine);
  setup.limb = sim::sample_limb(setup.scenario.limb, seed);
  setup.to_machine.delay = setup.to_operator.delay = 1ms;
  setup.seed = seed;
  return setup;
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

}  // namespace knuckle::test
