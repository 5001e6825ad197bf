// The default machine with six pressures on one node and a bus of 250 kbit/s, with rotary encoders, and with one node
// for all valves.
#include "tests/support/few_nodes.h"

#include <gtest/gtest.h>

#include <fstream>

#include "app/session/metrics.h"
#include "app/session/session_result.h"
#include "tests/support/axes_machine.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

std::string unsafe(const std::string& machine, const std::string& scenario, std::uint64_t seed) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("machine.toml")) << machine;
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  options.machine = folder.file("machine.toml");
  const session::Judged judged = session::judge(session::run_simulation(options, {}));
  std::string text;
  int safety = 0;
  for (const session::CriterionResult& c : judged.criteria) {
    if (c.kind != session::CriterionKind::kSafety) continue;
    ++safety;
    if (c.missed()) text += c.name + "; ";
  }
  EXPECT_GT(safety, 0) << scenario;
  return text;
}

TEST(FewNodes, AreSafeAmidFaultsAndInContact) {
  for (const char* scenario : {"bus_faults", "sensor_faults", "hidden_faults", "wall_contact"})
    for (const std::uint64_t seed : {1U, 2U})
      EXPECT_EQ(unsafe(few_nodes_text(), scenario, seed), "") << scenario << ", seed " << seed;
}

TEST(ValveAxes, AreSafeAmidFaultsAndInContact) {
  for (const char* scenario : {"free_motion", "wall_contact", "bus_faults", "hidden_faults"})
    EXPECT_EQ(unsafe(axes_text(), scenario, 1), "") << scenario;
  const std::string mixed = axes_text("{ 1 = \"arm_spool\", 2 = \"bucket_spool\", 4 = \"boom_spool\" }");
  EXPECT_EQ(unsafe(mixed, "bus_faults", 2), "");
}

TEST(RotaryEncoders, AreSafeAmidFaultsAndInContact) {
  for (const char* scenario : {"sensor_faults", "wall_contact"}) {
    EXPECT_EQ(unsafe(rotary_text(), scenario, 1), "") << scenario;
    EXPECT_EQ(unsafe(with_rotary_encoders(few_nodes_text()), scenario, 1), "") << scenario << ", on few nodes";
  }
}

}  // namespace
}  // namespace knuckle::test
