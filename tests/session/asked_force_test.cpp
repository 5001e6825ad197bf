// What a press asks for: its felt force at the machine's scale, and the impact of its approach.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "app/session/scenario.h"
#include "app/session/session_setup.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::session {
namespace {

constexpr double kForceScale = 1e-3;

struct Pressed {
  MachineDescription machine = load_machine(test::source_dir() + "/config/machines/solar015.toml");
  Scenario scenario = load_scenario(test::source_dir() + "/config/scenarios/wall_contact.toml", machine);
  sim::Phase& press = *std::ranges::find(scenario.phases, sim::PhaseKind::kPress, &sim::Phase::kind);
  [[nodiscard]] double asked_N() const {
    const std::vector<double> asked = asked_forces_N(machine, scenario, kForceScale);
    EXPECT_EQ(asked.size(), scenario.phases.size());
    return asked[static_cast<std::size_t>(&press - scenario.phases.data())];
  }
  [[nodiscard]] double impact_N() const { return asked_N() - press.force_N / kForceScale; }
};

TEST(AskedForce, ImpactGrowsWithSpeedAndTheRootOfStiffness) {
  Pressed it;
  const double impact_N = it.impact_N();
  EXPECT_GT(impact_N, 0);
  it.press.speed_mps *= 2;
  EXPECT_NEAR(it.impact_N(), 2 * impact_N, 1e-9 * impact_N);
  it.scenario.world.walls.front().stiffness_N_per_m *= 9;
  EXPECT_NEAR(it.impact_N(), 6 * impact_N, 1e-9 * impact_N);
}

TEST(AskedForce, WhatStrikesTheWallIsPartOfTheArmsMass) {
  const Pressed it;
  const double root_m = it.impact_N() / it.press.speed_mps;
  const double moved_kg = root_m * root_m / it.scenario.world.walls.front().stiffness_N_per_m;
  EXPECT_GT(moved_kg, 20);
  EXPECT_LT(moved_kg, 220) << "boom, arm and bucket together";
}

TEST(AskedForce, HarderPressesAskForMoreAndMovesForNothing) {
  Pressed it;
  const double asked_N = it.asked_N();
  it.press.force_N += 1;
  EXPECT_NEAR(it.asked_N(), asked_N + 1000, 1e-9);
  const std::vector<double> asked = asked_forces_N(it.machine, it.scenario, kForceScale);
  EXPECT_EQ(std::ranges::count(asked, 0.0), std::ssize(asked) - 1);
}

TEST(AskedForce, NothingToPressAsksForNothing) {
  Pressed it;
  it.press.direction = -it.press.direction;
  EXPECT_EQ(it.asked_N(), 0) << "the wall is behind";
  it.press.direction = -it.press.direction;
  it.press.until_break = true;
  EXPECT_EQ(it.asked_N(), 0);
  it.press.until_break = false;
  EXPECT_GT(it.asked_N(), 0);
  it.scenario.world.walls.front().hunt_crossley_N_per_m15 = 1e8;
  EXPECT_EQ(it.asked_N(), 0) << "no linear spring";
}

}  // namespace
}  // namespace knuckle::session
