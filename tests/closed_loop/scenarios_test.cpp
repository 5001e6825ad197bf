// Every scenario meets its own criteria: what a user gets from `knuckle simulate --scenario NAME`.
#include <gtest/gtest.h>

#include "app/session/session_result.h"

namespace knuckle::test {
namespace {

constexpr std::uint64_t kQuickSeeds = 2, kDeepSeeds = 20;

/// Empty where every criterion is met; else which are not, by how much.
std::string unmet(const std::string& scenario, std::uint64_t seed) {
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  const session::SessionResult result = session::run_simulation(options, {});
  const session::Judged judged = session::judge(result);
  EXPECT_FALSE(judged.criteria.empty());
  std::string text;
  for (const session::CriterionResult& c : judged.criteria) {
    if (c.passed) continue;
    text += c.name + " = " + (c.value ? std::to_string(*c.value) : "not measured") + ", " + c.relation + " " +
            std::to_string(c.bound) + "; ";
  }
  return text;
}

class Scenario : public testing::TestWithParam<const char*> {};

TEST_P(Scenario, MeetsItsCriteria) {
  for (std::uint64_t seed = 1; seed <= kQuickSeeds; ++seed) {
    EXPECT_EQ(unmet(GetParam(), seed), "") << "seed " << seed;
  }
}

class ScenarioDrawn : public testing::TestWithParam<const char*> {};

TEST_P(ScenarioDrawn, MeetsItsCriteriaForDrawnMachinesAndHands) {
  for (std::uint64_t seed = kQuickSeeds + 1; seed <= kDeepSeeds; ++seed) {
    EXPECT_EQ(unmet(GetParam(), seed), "") << "seed " << seed;
  }
}

/// Hands that never come to rest on the wall: the force along it swings, up to a kilonewton, until the piece breaks.
TEST(DeepScenarioDraws, ForceThatNeverRestsIsJudgedLikeAnyOther) {
  for (const std::uint64_t seed : {14U, 22U, 24U, 43U, 98U, 105U, 176U}) {
    EXPECT_EQ(unmet("dismantle", seed), "") << "seed " << seed;
  }
}

const auto kScenarios = testing::Values("dismantle", "free_motion", "wall_contact", "dig_cycle", "lift_weight",
                                        "link_faults", "sensor_faults", "hidden_faults", "bus_faults", "buried_pipe");
const auto kName = [](const auto& test) { return std::string(test.param); };
INSTANTIATE_TEST_SUITE_P(Scenarios, Scenario, kScenarios, kName);
INSTANTIATE_TEST_SUITE_P(DeepScenarios, ScenarioDrawn, kScenarios, kName);

}  // namespace
}  // namespace knuckle::test
