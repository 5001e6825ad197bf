// What is drawn: the same for the same index, runnable, spread over what the grid says, and never from inside a wall.
#include "app/battery/cell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "app/battery/rows.h"
#include "app/session/session_setup.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "sim/plant.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::battery {
namespace {

using namespace std::chrono_literals;
using test::says;

Settings settings_named(const std::string& name) {
  return load_settings(test::source_dir() + "/config/grids/" + name + ".toml");
}

/// The phase in which the bucket comes to the wall.
auto before_press(const session::Scenario& scenario) {
  return std::prev(std::find_if(scenario.phases.begin(), scenario.phases.end(),
                                [](const sim::Phase& phase) { return phase.kind == sim::PhaseKind::kPress; }));
}

TEST(BatteryCell, IsAPureFunctionOfSettingsAndIndexAlsoThroughItsResultsJson) {
  for (const char* name : {"feel", "work"}) {
    const Settings settings = settings_named(name);
    const auto json = nlohmann::ordered_json::parse(settings_json(settings).dump());
    const Drawer one(settings), other(settings_of(json, "test"));
    (void)other.cell(settings.sessions - 1);  // whatever was drawn before
    for (std::uint64_t index = 0; index < 20; ++index) {
      const Cell a = one.cell(index), b = other.cell(index);
      EXPECT_EQ(a.options.scenario_text, b.options.scenario_text);
      EXPECT_EQ(a.options.seed, b.options.seed);
      EXPECT_EQ(a.drawn, b.drawn);
    }
    EXPECT_NE(one.cell(0).drawn, one.cell(1).drawn);
    Settings reseeded = settings;
    reseeded.seed = 2;
    EXPECT_NE(Drawer(reseeded).cell(0).drawn, one.cell(0).drawn);
  }
}

TEST(BatteryCell, DrawsEverythingItsGridSays) {
  const Settings settings = settings_named("feel");
  const Drawer drawer(settings);
  std::set<std::string> limbs, places, parts;
  std::map<double, int> rtts;
  double softest = 1e9, stiffest = 0;
  for (std::uint64_t index = 0; index < 600; ++index) {
    const auto drawn = drawer.cell(index).drawn;
    limbs.insert(drawn["limb"].get<std::string>());
    places.insert(drawn["place"].get<std::string>());
    parts.insert(drawn["part"].get<std::string>());
    ++rtts[drawn["rtt_ms"].get<double>()];
    softest = std::min(softest, drawn["stiffness_N_per_m"].get<double>());
    stiffest = std::max(stiffest, drawn["stiffness_N_per_m"].get<double>());
    EXPECT_LE(drawn["jitter_ms"].get<double>(), 0.5 * drawn["rtt_ms"].get<double>());
    const double most_felt = drawn["limb"] == "light_grip" ? 1.8 : 3.5;
    EXPECT_LE(drawn["felt_N"].get<double>(), most_felt);
  }
  EXPECT_EQ(limbs.size(), 4U);
  EXPECT_EQ(places.size(), 5U);
  EXPECT_TRUE(parts.contains("tip") && parts.contains("heel")) << "contact is not at the tip alone";
  EXPECT_EQ(rtts.size(), settings.rtt_ms.size());
  EXPECT_LT(softest, 3e4);
  EXPECT_GT(stiffest, 3e7);
}

TEST(BatteryCell, APersonIsAskedForWhatAHandHolds) {
  Settings settings = settings_named("feel");
  settings.person = "rough";
  settings.family = "serviced";  // some places bear less than 3 N
  settings.felt_N = {3, 10};
  const Drawer drawer(settings);
  for (std::uint64_t index = 0; index < 60; ++index) {
    const Cell cell = drawer.cell(index);
    EXPECT_NO_THROW((void)session::load_session(cell.options)) << cell.options.scenario_text;
  }
}

TEST(BatteryCell, CommissionedMachinesTakeTurnsInTheSamePresses) {
  const test::TemporaryFolder folder;
  Settings settings = settings_named("feel");
  const Drawer unknown(settings);
  const std::string drawing = test::source_dir() + "/config/machines/solar015.toml";
  settings.commissioned = {{drawing, 11}, {folder.file("other.toml"), 12}};
  const Settings again = settings_of(settings_json(settings), "test");
  const Drawer drawer(again);
  for (std::uint64_t index = 0; index < 6; ++index) {
    const Cell cell = drawer.cell(index);
    EXPECT_EQ(cell.options.machine, settings.commissioned[index % 2].file);
    EXPECT_EQ(cell.options.machine_seed, 11 + index % 2);
    EXPECT_EQ(cell.options.seed, unknown.cell(index).options.seed);
    EXPECT_EQ(cell.options.scenario_text, unknown.cell(index).options.scenario_text);
    EXPECT_EQ(cell.effects, drawer.cell(index + 2).effects) << "the same machine";
  }
  // The session's truth is that machine's, on another day.
  const session::SessionSetup first = session::load_session(drawer.cell(0).options).setup;
  const session::SessionSetup later = session::load_session(drawer.cell(2).options).setup;
  EXPECT_EQ(first.truth.machine.links[0].mass_kg, later.truth.machine.links[0].mass_kg);
  EXPECT_NE(first.truth.viscosity_factor, later.truth.viscosity_factor);
}

TEST(BatteryCell, EveryPressStartsInTheOpenAndNoneMeetsTheWallWithTheBucketsLinkage) {
  int overhead = 0;
  for (const auto& [name, cells] : {std::pair{"solar015", 200U}, {"compact080", 60U}}) {
    Settings settings = settings_named("feel");
    settings.machine = name;
    const MachineDescription machine = load_machine(find_config("machine", name));
    const Kinematics kinematics(machine);
    const Drawer drawer(settings);
    for (std::uint64_t index = 0; index < cells; ++index) {
      SCOPED_TRACE(std::string(name) + " cell " + std::to_string(index));
      const Cell cell = drawer.cell(index);
      const session::SessionSetup setup = session::load_session(cell.options).setup;
      const session::Scenario& scenario = setup.scenario;
      EXPECT_EQ(sim::Plant(setup.truth, scenario.world, scenario.start_rad).state().contact_N.norm(), 0);
      const auto& wall = scenario.world.walls.front();
      const MachinePose pose =
          pose_of(machine, *kinematics.inverse(before_press(scenario)->tip_m, before_press(scenario)->bucket_rad));
      double part_m = 1e9;
      for (const PlanarVector& corner : bucket_outline(machine))
        part_m = std::min(part_m, wall.normal.dot(pose.bucket * corner - wall.point_m));
      EXPECT_GT(wall.normal.dot(pose.linkage_pin_m - wall.point_m), part_m);
      overhead += cell.drawn["place"] == "overhead";
    }
  }
  EXPECT_GT(overhead, 20);
}

// A machine that pushes something overhead with all that the arm can would stand on the front end of its tracks.
TEST(BatteryCell, NoPressTipsAMachineThatStandsOnGround) {
  Settings settings = settings_named("feel");
  settings.family = "serviced";
  const Kinematics kinematics(load_machine(find_config("machine", settings.machine)));
  const Drawer drawer(settings);
  int overhead = 0;
  for (std::uint64_t index = 0; index < 250; ++index) {
    const Cell cell = drawer.cell(index);
    if (cell.drawn["part"] != "tip" && cell.drawn["place"] != "overhead") continue;
    const session::SessionSetup setup = session::load_session(cell.options).setup;
    const auto& wall = setup.scenario.world.walls.front();
    const auto approach = before_press(setup.scenario), press = std::next(approach);
    const PlanarVector tip_m = cell.drawn["part"] == "tip" ? wall.point_m : approach->tip_m;
    // The pull is at the tip, and as large as what has the same moment about the boom pin as the force at the heel.
    const PlanarVector pressed_N = press->force_N / setup.device.feel.force_scale * wall.normal;
    sim::Plant plant(setup.truth, {}, *kinematics.inverse(tip_m, approach->bucket_rad));
    const PlanarVector pull_N = cross(wall.point_m, pressed_N) / cross(tip_m, pressed_N) * pressed_N;
    constexpr int kGently = 2000;  // or it would rock
    for (int i = 0; i < kGently; ++i) {
      plant.set_pull(pull_N * i / kGently);
      plant.step(1ms);
    }
    const auto& push_N = plant.state().track_N;
    EXPECT_GT(*std::min_element(push_N.begin(), push_N.end()), 0) << index;
    overhead += cell.drawn["place"] == "overhead";
  }
  EXPECT_GT(overhead, 10);
}

TEST(BatteryThreads, RunSessionsOfBothBatteriesSideBySideAsOneAfterTheOtherWithTheirMetrics) {
  const std::array drawers{Drawer(settings_named("feel")), Drawer(settings_named("work"))};
  std::array<Row, 2> together;
  {
    std::array<std::jthread, 2> threads;
    for (std::size_t i = 0; i < threads.size(); ++i)
      threads[i] = std::jthread([&, i] { together[i] = run_cell(drawers[i], 1); });
  }
  for (std::size_t i = 0; i < together.size(); ++i) {
    ASSERT_TRUE(was_run(together[i])) << together[i].dump();
    EXPECT_EQ(together[i].dump(), run_cell(drawers[i], 1).dump());
  }
  for (const char* metric : {"felt_error_rel", "unfelt_s", "hold_error_N", "peak_over_asked"})
    EXPECT_TRUE(together[0]["metrics"][metric].is_number()) << metric;
  EXPECT_FALSE(together[1]["metrics"].empty());
  const std::string stock = find_config("scenario", together[1]["drawn"]["scenario"].get<std::string>());
  EXPECT_TRUE(std::filesystem::exists(stock)) << stock;
}

TEST(BatteryCell, AResultThatWasEditedIsRefused) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("result.json");
  Settings settings = settings_named("feel");
  settings.sessions = 1;
  nlohmann::ordered_json result;
  result["schema"] = kResultSchema;
  result["settings"] = settings_json(settings);
  result["rows"][0]["cell"] = 0;
  result["rows"][0]["digest"] = "of this build";
  std::ofstream(file) << result;
  EXPECT_EQ(cell_of_result(file + ":0").cell_digest, "of this build");
  const auto said = [](const std::string& name) { return test::refusal([&] { (void)cell_of_result(name); }); };
  EXPECT_TRUE(says(said(file + ":5"), "sessions 0 to 0"));
  EXPECT_TRUE(says(said(file), "must be FILE:N"));
  // Where, as JSON what, and what is said.
  const struct {
    const char *where, *is, *said;
  } kEdits[]{
      {"/schema", "3", "is not a result of"},
      {"/settings/control", R"("tdpa")", "settings: control = tdpa: must be echo, cues or direct"},
      {"/settings/seed", "-1", "seed = -1: must be 1 or more"},
      {"/settings/sessions", "0", "sessions = 0: must be 1 or more"},
      {"/settings/loss", "[1.5]", "result.json: settings: loss = 1.5: must be within [0, 1]"},
      {"/settings/rtt_ms", "[]", "settings: rtt_ms = []: must have at least one value"},
      {"/settings/felt_N", "[3, 2]", "felt_N = [3,2]: must be [low, high]"},
      {"/settings/speed_mps", "[0.1, 2]", "speed_mps = 2: must be within [0.01, 1]"},
      {"/settings/commissioned", R"([{"file": "out/mine.toml", "seed": 1}])",
       "settings: machine = out/mine.toml: is not there: run this in the folder in which the battery ran"},
      {"/rows", "[]", "rows: has none of session 0"},
      {"/rows", R"("none")", "rows: has none of session 0"},
      {"/rows/0", R"({"cell": 0})", "rows: has none of session 0"},
  };
  for (const auto& edit : kEdits) {
    nlohmann::ordered_json edited = result;
    edited[nlohmann::ordered_json::json_pointer(edit.where)] = nlohmann::ordered_json::parse(edit.is);
    std::ofstream(file) << edited;
    EXPECT_TRUE(says(said(file + ":0"), edit.said)) << edit.where;
  }
  std::ofstream(file) << "mine";
  EXPECT_TRUE(says(said(file + ":0"), "is not complete JSON"));
}

TEST(BatteryCell, WhatCannotRunSaysWhy) {
  Cell cell;
  cell.options.scenario = "nowhere";
  const Row row = run_cell(cell);
  EXPECT_FALSE(was_run(row));
  EXPECT_TRUE(says(row["refused"].get<std::string>(), "nowhere"));
  EXPECT_FALSE(passed(row));
  EXPECT_FALSE(metric_of(row, "hold_error_N"));
}

}  // namespace
}  // namespace knuckle::battery
