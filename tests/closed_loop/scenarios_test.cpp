// Every scenario meets its safety bounds in every session, and its requirements in most: what a user gets from `knuckle
// simulate --scenario NAME`. Bounds of requirements are set by other sessions (docs/scenarios.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/session/metrics.h"
#include "app/session/record_windows.h"
#include "app/session/session_result.h"
#include "tests/support/places.h"

namespace knuckle::test {
namespace {

/// What the device may give to the hand over a session. Not 0: the force on the hand is late, so that a hand that lets
/// go of a hard contact quicker than that gets some of it back (worst of all: `taps`).
constexpr double kMostGiven_J = 0.05;

constexpr const char* kScenarios[] = {"bus_faults",
                                      "buried_pipe",
                                      "chisel",
                                      "clutch_in_contact",
                                      "dig_cycle",
                                      "dismantle",
                                      "fault_in_contact",
                                      "free_air",
                                      "free_motion",
                                      "grade_slope",
                                      "hidden_faults",
                                      "home_on_two",
                                      "joint_ends",
                                      "level",
                                      "lift_weight",
                                      "let_go_in_contact",
                                      "link_faults",
                                      "pry",
                                      "slam",
                                      "press_with_load",
                                      "sensor_faults",
                                      "two_contacts",
                                      "taps",
                                      "wall_contact",
                                      "wall_drag",
                                      "wall_edge"};
// The hand follows a recording, which is an option: their requirements decide with --judge.
constexpr const char* kRecorded[] = {"recorded_dig", "recorded_dig_soil"};

/// In a warm-up the force estimate adapts to air. Empty, or what is wrong with it.
std::string warm_up_trouble(const session::SessionRecord& record) {
  bool missing = std::find(record.phases.begin(), record.phases.end(), "warm_up") != record.phases.end();
  for (const session::Sample& s : record.samples) {
    if (session::phase_name(record, s) != "warm_up") continue;
    missing = false;
    if (session::in_contact(s)) {
      return "the warm-up touches something with " + std::to_string(s.truth.tip_force_N.norm()) + " N at " +
             std::to_string(s.t_s) + " s";
    }
  }
  return missing ? "the warm-up never began" : "";
}

const std::string kRecording = source_dir() + "/../shared/data/excavator_dig_cycles/W2_data_326.csv";

/// The default machine, as shipped.
session::Judged judged(const std::string& scenario, std::uint64_t seed) {
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  if (scenario.starts_with("recorded_")) {
    options.operator_name = "path:" + kRecording;
    options.map = source_dir() + "/config/maps/excavator_dig_cycles.toml";
    options.judge = true;
  }
  session::SessionResult result = session::run_simulation(options, {});
  EXPECT_TRUE(result.requirements_decide);
  EXPECT_EQ(warm_up_trouble(result.record), "") << scenario << ", seed " << seed;
  result.criteria.push_back({"net_energy_J", {}, kMostGiven_J, session::CriterionKind::kRequirement});
  return session::judge(result);
}

std::string text_of(const session::CriterionResult& c) {
  return c.name + " = " + (c.value ? std::to_string(*c.value) : "not measured") + ", " + c.relation + " " +
         std::to_string(c.bound);
}

/// Sessions of a scenario: each is held to the safety bounds, all together to the requirements.
class Sessions {
 public:
  explicit Sessions(std::string scenario) : scenario_(std::move(scenario)) {}
  void run(std::uint64_t first_seed, std::uint64_t count) {
    for (std::uint64_t seed = first_seed; seed < first_seed + count; ++seed) {
      for (const session::CriterionResult& c : judged(scenario_, seed).criteria) {
        EXPECT_NE(c.kind, session::CriterionKind::kCriterion) << c.name << ": a shipped scenario says what kind it is";
        if (!c.missed() || c.kind == session::CriterionKind::kGoal) continue;
        const std::string text = text_of(c) + ", seed " + std::to_string(seed);
        if (c.kind == session::CriterionKind::kRequirement)
          missed_[c.name + " " + c.relation + " " + std::to_string(c.bound)].push_back(text);
        else
          ADD_FAILURE() << text;
      }
    }
  }
  [[nodiscard]] bool missed_any() const { return !missed_.empty(); }
  void expect_each_missed_by_at_most(std::size_t sessions) const {
    for (const auto& [bound, texts] : missed_) EXPECT_LE(texts.size(), sessions) << testing::PrintToString(texts);
  }

 private:
  std::string scenario_;
  std::map<std::string, std::vector<std::string>> missed_;  ///< By requirement.
};

/// Any session may be unlucky: where one misses a requirement, most of five decide. Each night draws forty (below).
void expect_met_by_most(const std::string& scenario) {
  Sessions sessions(scenario);
  sessions.run(1, 1);
  if (sessions.missed_any()) sessions.run(2, 4);
  sessions.expect_each_missed_by_at_most(2);
}

class Scenario : public testing::TestWithParam<const char*> {};

TEST_P(Scenario, MeetsItsSafetyBoundsAlwaysAndEachRequirementInMostSessions) {
  expect_met_by_most(GetParam());
}

TEST(RecordedScenarios, MeetTheirSafetyBoundsAlwaysAndEachRequirementInMostSessions) {
  if (!std::filesystem::exists(kRecording))
    GTEST_SKIP() << "NOT TESTED: real recordings: no ../shared/data/excavator_dig_cycles";
  for (const char* scenario : kRecorded) {
    SCOPED_TRACE(scenario);
    expect_met_by_most(scenario);
  }
}

class ScenarioDrawn : public testing::TestWithParam<const char*> {};

TEST_P(ScenarioDrawn, MeetsItsSafetyBoundsAlwaysAndEachRequirementInNineOfTenSessions) {
  Sessions sessions(GetParam());
  sessions.run(201, 40);
  sessions.expect_each_missed_by_at_most(4);
}

TEST(Scenarios, AreAllTested) {
  std::set<std::string> shipped, tested(std::begin(kScenarios), std::end(kScenarios));
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() + "/config/scenarios"))
    shipped.insert(entry.path().stem().string());
  tested.insert(std::begin(kRecorded), std::end(kRecorded));
  EXPECT_EQ(shipped, tested);
}

/// Hands that never come to rest on the wall: the force along it swings, up to 1.7 kN, until the piece breaks. All is
/// measured all the same.
TEST(DeepScenarioDraws, ForceThatNeverRestsIsJudgedLikeAnyOther) {
  for (const std::uint64_t seed : {14U, 22U, 24U, 43U, 98U, 105U, 176U}) {
    for (const session::CriterionResult& c : judged("dismantle", seed).criteria) {
      EXPECT_TRUE(c.value) << c.name << ", seed " << seed;
      EXPECT_FALSE(c.kind == session::CriterionKind::kSafety && c.missed()) << text_of(c) << ", seed " << seed;
    }
  }
}

const auto kName = [](const auto& test) { return std::string(test.param); };
INSTANTIATE_TEST_SUITE_P(Scenarios, Scenario, testing::ValuesIn(kScenarios), kName);
INSTANTIATE_TEST_SUITE_P(DeepScenarios, ScenarioDrawn, testing::ValuesIn(kScenarios), kName);

}  // namespace
}  // namespace knuckle::test
