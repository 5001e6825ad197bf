// Whole sessions of a machine whose valves are told by ISO 11783-7: flow, and which way.
#include <gtest/gtest.h>

#include <fstream>

#include "app/session/metrics.h"
#include "app/session/session_result.h"
#include "machine/reason_text.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

TEST(ValveCommands, MoveAMachineInAirAndAgainstAWallWithinItsSafetyBounds) {
  const TemporaryFolder folder;
  const std::string file = folder.file("valves.toml");
  std::ofstream(file) << valves_text();
  for (const char* scenario : {"free_motion", "wall_contact"}) {
    session::SimulateOptions options;
    options.scenario = scenario;
    options.machine = file;
    options.seed = 1;
    const session::SessionResult result = session::run_simulation(options, {});
    const session::Judged judged = session::judge(result);
    int safety = 0;
    for (const session::CriterionResult& one : judged.criteria) {
      if (one.kind != session::CriterionKind::kSafety) continue;
      ++safety;
      EXPECT_TRUE(one.met.value_or(false))
          << scenario << ": " << one.name << " " << one.value.value_or(-1) << " " << one.relation << " " << one.bound;
    }
    EXPECT_EQ(safety, 2) << scenario;
    EXPECT_TRUE(result.record.plan_finished) << scenario;
    EXPECT_TRUE(result.record.faults.empty())
        << scenario << ": " << text_with_code(result.record.faults.front().reason, valves_machine().bus);
  }
}

}  // namespace
}  // namespace knuckle::test
