// Whole sessions of machines that are led by frames and measure the pressures that move their spools: no sound machine
// is stopped by them.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "app/session/metrics.h"
#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/command_machine.h"

namespace knuckle::test {
namespace {

/// With pilot pressures that are up to 3 % of full stroke other than the file has them.
session::SessionSetup piloted_setup(const char* commands, const std::string& scenario, sim::Family family,
                                    std::uint64_t seed) {
  const MachineDescription machine = parse_machine(command_text(commands, state_with_pilots()), "m.toml");
  session::SessionSetup setup =
      setup_of(machine, "knuckle1", session::load_scenario(find_config("scenario", scenario), machine), seed, family);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<> error(-0.03, 0.03);
  for (BroadcastFrame& frame : setup.truth.machine.bus.broadcasts) {
    for (BroadcastField& field : frame.fields) {
      if (field.info().role != NodeRole::kPilot) continue;
      const double full_Pa = field.full_Pa;
      field.shut_Pa += error(random) * full_Pa;
      field.full_Pa += error(random) * full_Pa;
    }
  }
  return setup;
}

class PilotedSessions : public testing::TestWithParam<const char*> {
 protected:
  /// Nor a missed safety bound, moving and pressing.
  static void expect_no_fault(sim::Family family, std::uint64_t seed) {
    for (const char* scenario : {"free_motion", "wall_contact"}) {
      const session::SessionSetup setup = piloted_setup(GetParam(), scenario, family, seed);
      const FinishedSession finished = run_session(setup);
      for (const session::FaultRecord& fault : finished.record.faults) {
        ADD_FAILURE() << scenario << ", seed " << seed << ": " << text_with_code(fault.reason, setup.machine.bus)
                      << " at " << fault.at_s;
      }
      int safety = 0;
      for (const session::CriterionResult& c : session::evaluate(setup.scenario.criteria, finished.metrics)) {
        if (c.kind != session::CriterionKind::kSafety) continue;
        ++safety;
        EXPECT_FALSE(c.missed()) << scenario << ", seed " << seed << ": " << c.name;
      }
      EXPECT_EQ(safety, 2) << scenario;
      EXPECT_EQ(finished.allocations, 0U);
    }
  }
};

TEST_P(PilotedSessions, OfSoundMachinesHaveNoFaultByThemAndKeepTheirSafetyBounds) {
  expect_no_fault(sim::Family::kSmooth, 1);
  expect_no_fault(sim::Family::kServiced, 2);
}

class PilotedSessionsDrawn : public PilotedSessions {};

TEST_P(PilotedSessionsDrawn, OfSoundMachinesHaveNoFaultByThemAndKeepTheirSafetyBounds) {
  for (const std::uint64_t seed : {2U, 3U}) expect_no_fault(sim::Family::kSmooth, seed);
  expect_no_fault(sim::Family::kServiced, 1);
}

const auto kPilotedKinds = testing::Values(kRateCommands, kPilotCommands);
const auto kPilotedKind = [](const auto& kind) { return kind.index == 0 ? "JointRate" : "PilotPressure"; };
INSTANTIATE_TEST_SUITE_P(Kinds, PilotedSessions, kPilotedKinds, kPilotedKind);
INSTANTIATE_TEST_SUITE_P(DeepKinds, PilotedSessionsDrawn, kPilotedKinds, kPilotedKind);

}  // namespace
}  // namespace knuckle::test
