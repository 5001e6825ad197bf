// Whole sessions of machines that are led by frames and measure the pressures that move their spools: no sound machine
// is stopped by them.
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <string>

#include "app/session/metrics.h"
#include "app/session/session_result.h"
#include "machine/reason_text.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/command_machine.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

/// With pilot pressures that are up to 3 % of full stroke other than the file has them.
session::SessionSetup piloted_setup(const char* commands, const std::string& scenario, sim::Family family,
                                    std::uint64_t seed) {
  session::SessionSetup setup;
  const MachineDescription machine = parse_machine(command_text(commands, state_with_pilots()), "m.toml");
  setup.device = load_device(find_config("device", "knuckle1"));
  setup.scenario = session::load_scenario(find_config("scenario", scenario), machine);
  setup.truth = sim::sample_truth(machine, family, seed);
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
  setup.machine = calibrated(machine);
  setup.limb = sim::sample_limb(setup.scenario.limb, seed);
  setup.to_machine.delay = setup.to_operator.delay = 1ms;
  setup.seed = seed;
  return setup;
}

class PilotedSessions : public testing::TestWithParam<const char*> {};

TEST_P(PilotedSessions, OfSoundMachinesHaveNoFaultByThem) {
  for (const char* scenario : {"free_motion", "wall_contact"}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      for (const sim::Family family : {sim::Family::kSmooth, sim::Family::kServiced}) {
        if (family == sim::Family::kServiced && seed > 2) continue;
        const session::SessionSetup setup = piloted_setup(GetParam(), scenario, family, seed);
        const FinishedSession finished = run_session(setup);
        for (const session::FaultRecord& fault : finished.record.faults) {
          ADD_FAILURE() << scenario << ", seed " << seed << ": " << text_with_code(fault.reason, setup.machine.bus)
                        << " at " << fault.at_s;
        }
        EXPECT_EQ(finished.allocations, 0U);
      }
    }
  }
}

TEST_P(PilotedSessions, KeepTheirSafetyBounds) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("machine.toml")) << command_text(GetParam(), state_with_pilots());
  for (const char* scenario : {"free_motion", "wall_contact"}) {
    session::SimulateOptions options;
    options.scenario = scenario;
    options.seed = 4;
    options.machine = folder.file("machine.toml");
    int safety = 0;
    for (const session::CriterionResult& c : session::judge(session::run_simulation(options, {})).criteria) {
      if (c.kind != session::CriterionKind::kSafety) continue;
      ++safety;
      EXPECT_FALSE(c.missed()) << scenario << ": " << c.name;
    }
    EXPECT_EQ(safety, 2) << scenario;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, PilotedSessions, testing::Values(kRateCommands, kPilotCommands),
                         [](const auto& kind) { return kind.index == 0 ? "JointRate" : "PilotPressure"; });

}  // namespace
}  // namespace knuckle::test
