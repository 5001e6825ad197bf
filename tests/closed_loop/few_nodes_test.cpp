// The default machine with six pressures on one node and a bus of 250 kbit/s.
#include "tests/support/few_nodes.h"

#include <gtest/gtest.h>

#include <fstream>

#include "app/session/metrics.h"
#include "app/session/session_result.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

std::string unsafe(const std::string& scenario, std::uint64_t seed) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("few.toml")) << few_nodes_text();
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  options.machine = folder.file("few.toml");
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
    for (const std::uint64_t seed : {1U, 2U}) EXPECT_EQ(unsafe(scenario, seed), "") << scenario << ", seed " << seed;
}

}  // namespace
}  // namespace knuckle::test
