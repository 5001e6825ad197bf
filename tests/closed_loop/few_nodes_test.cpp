// The default machine with six pressures on one node and a bus of 250 kbit/s, with rotary encoders, and with one node
// for all valves; and one whose valves are told by ISO 11783-7: flow, and which way.
#include "tests/support/few_nodes.h"

#include <gtest/gtest.h>

#include <fstream>

#include "app/session/metrics.h"
#include "app/session/session_result.h"
#include "tests/support/axes_machine.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

/// The safety bounds that were missed; whether it never came to the end of a press.
std::string unsafe(const std::string& machine, const std::string& scenario, std::uint64_t seed = 1) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("machine.toml")) << machine;
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  options.machine = folder.file("machine.toml");
  const session::SessionResult result = session::run_simulation(options, {});
  const session::Judged judged = session::judge(result);
  std::string text;
  if (scenario == "wall_contact" && !result.record.plan_finished) text = "plan not finished; ";
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
    EXPECT_EQ(unsafe(few_nodes_text(), scenario), "") << scenario;
}

TEST(DeepFewNodes, AreSafeAmidFaultsAndInContactInMoreSessions) {
  for (const char* scenario : {"bus_faults", "sensor_faults", "hidden_faults", "wall_contact"})
    EXPECT_EQ(unsafe(few_nodes_text(), scenario, 2), "") << scenario;
  for (const char* scenario : {"free_motion", "bus_faults"}) EXPECT_EQ(unsafe(axes_text(), scenario), "") << scenario;
  EXPECT_EQ(unsafe(rotary_text(), "sensor_faults"), "");
  EXPECT_EQ(unsafe(with_rotary_encoders(few_nodes_text()), "wall_contact"), "");
  EXPECT_EQ(unsafe(valves_text(), "free_motion"), "");
}

TEST(ValveAxes, AreSafeAmidFaultsAndInContact) {
  for (const char* scenario : {"wall_contact", "hidden_faults"})
    EXPECT_EQ(unsafe(axes_text(), scenario), "") << scenario;
  const std::string mixed = axes_text("{ 1 = \"arm_spool\", 2 = \"bucket_spool\", 4 = \"boom_spool\" }");
  EXPECT_EQ(unsafe(mixed, "bus_faults", 2), "");
}

TEST(RotaryEncoders, AreSafeAmidFaultsAndInContact) {
  EXPECT_EQ(unsafe(rotary_text(), "wall_contact"), "");
  EXPECT_EQ(unsafe(with_rotary_encoders(few_nodes_text()), "sensor_faults"), "");
}

TEST(ValveCommands, MoveAMachineInAirAndAgainstAWallWithinItsSafetyBounds) {
  EXPECT_EQ(unsafe(valves_text(), "wall_contact"), "");
}

}  // namespace
}  // namespace knuckle::test
