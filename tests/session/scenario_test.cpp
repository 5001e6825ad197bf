// Scenario files: shipped ones fit the shipped machines, every key is needed and bounded, lengths and loads follow the
// machine's size.
#include "app/session/scenario.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "machine/load.h"
#include "tests/support/broadcast_machine.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::session {
namespace {
namespace fs = std::filesystem;

constexpr double kDeg = std::numbers::pi / 180;
const fs::path kConfig = fs::path(test::source_dir()) / "config";

/// Every section once. A line that ends in "#o" may be left out.
constexpr const char* kWhole = R"(
name = "whole"
description = "Everything a scenario can have."
reference_reach_m = 3.2
reference_payload_kg = 150
start_deg = [40, -75, -40]
hand_deg = [42, -77, -38]
duration_s = 60
[link] #o
delay_ms = 10
[operator]
limb = "normal"
reaction_ms = 200
[[phase]]
name = "engage"
kind = "engage"
timeout_s = 20 #o
[[phase]]
name = "sweep"
kind = "sweep"
amplitude_deg = [12, 18, 22]
period_s = [9, 7, 5.5]
duration_s = 20
until_fault = true #o
[[phase]]
name = "approach"
kind = "move"
tip_m = [2.2, 0.1]
bucket_deg = -75
speed_mps = 0.3
tolerance_m = 0.05 #o
[[phase]]
name = "home"
kind = "move"
joints_deg = [40, -75, -40]
speed_radps = 0.4
[[phase]]
name = "press"
kind = "press"
direction = [0.5, 0]
speed_mps = 0.1
felt_N = 2.0
hold_s = 10
[[phase]]
name = "index"
kind = "clutch"
hand_deg = [5, 5, 5]
[[phase]]
name = "rest"
kind = "wait"
duration_s = 2
[[wall]]
point_m = [2.55, 0.5]
normal = [-1, 0]
stiffness_N_per_m = 1e6
damping_ratio = 0.3
friction = 0.4
from_m = -1 #o
to_m = 1 #o
break_force_N = 2200
break_impulse_Ns = 800
piece_mass_kg = 45
piece_depth_m = 0.3
piece_rest_m = [1.85, -0.75]
[[soil]]
surface_point_m = [0, -0.8]
slope_deg = 0
density_kg_per_m3 = 1700
cohesion_Pa = 3000
internal_friction_deg = 32
tool_friction_deg = 20
bucket_width_m = 0.45
bucket_capacity_m3 = 0.04
[[weight]]
mass_kg = 50
attach_at_s = 34
detach_at_s = 40 #o
[[piece]]
mass_kg = 30
position_m = [1.7, -0.7]
[[pipe]]
centre_m = [1.6, -1.0]
radius_m = 0.05
[[fault]]
kind = "node_silent"
phase = "sweep"
after_s = 2.3
duration_s = 1.0
node = "arm_head_pressure"
[[fault]]
kind = "valve_stuck"
phase = "sweep"
after_s = 9
duration_s = 1.0
joint = "arm"
[[criteria]]
metric = "tip_rms_m"
max = 0.05
[[criteria]]
metric = "payload_error_kg"
max = 5
[[criteria]]
metric = "no_load_rms_N"
max = 150
[[criteria]]
metric = "hold_error_N"
max = 0.3
[[goal]]
metric = "unfelt_s"
max = 0
[[requirement]]
metric = "peak_N"
max = 4000
[[safety]]
metric = "faults"
max = 2
)";

const MachineDescription& machine_named(const std::string& name = "solar015") {
  static const MachineDescription small = load_machine(kConfig / "machines/solar015.toml");
  static const MachineDescription large = load_machine(kConfig / "machines/compact080.toml");
  return name == "solar015" ? small : large;
}

class ScenarioFile : public ::testing::Test {
 protected:
  ~ScenarioFile() override { fs::remove(path_); }
  Scenario load(const std::string& text, const MachineDescription& m = machine_named()) {
    std::ofstream(path_) << text;
    return load_scenario(path_, m);
  }
  /// The message with which `text` is refused; empty where it is not.
  std::string refusal(const std::string& text, const MachineDescription& m = machine_named()) {
    const std::string line = test::refusal([&] { return load(text, m); });
    if (line == "accepted") return "";
    EXPECT_FALSE(test::says(line, "\n"));
    EXPECT_TRUE(test::says(line, path_.filename().string()));
    return line;
  }
  static std::string with(const std::string& from, const std::string& to) {
    std::string text = kWhole;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  struct Refused {
    std::string from, to;
    std::vector<std::string> named;
  };
  void expect_refused(const std::vector<Refused>& changes) {
    for (const Refused& change : changes) {
      const std::string line = refusal(with(change.from, change.to));
      for (const std::string& word : change.named) EXPECT_TRUE(test::says(line, word)) << change.to;
    }
  }

  fs::path path_ = fs::temp_directory_path() / ("knuckle_scenario_" + std::to_string(getpid()) + ".toml");
};

TEST(Scenarios, ShippedOnesLoadForEveryShippedMachine) {
  int loaded = 0;
  for (const auto& scenario : fs::directory_iterator(kConfig / "scenarios")) {
    for (const auto& file : fs::directory_iterator(kConfig / "machines")) {
      if (file.path().extension() != ".toml") continue;
      const MachineDescription m = load_machine(file.path());
      const std::string said = test::refusal([&] { (void)load_scenario(scenario.path(), m); });
      // Nodes that a machine does not have cannot fail on it.
      const bool is_node = !m.bus.broadcasts.empty() && said.find("].node' = ") != std::string::npos;
      EXPECT_TRUE(said == "accepted" || is_node) << scenario.path() << " on " << m.name << ": " << said;
      if (said == "accepted") ++loaded;
    }
    EXPECT_EQ(load_scenario(scenario.path(), machine_named()).name, scenario.path().stem().string());
  }
  EXPECT_GE(loaded, 16);
}

/// Else what is worked towards may get worse unseen.
TEST(Scenarios, HaveALooserRequirementBesideEachGoal) {
  const auto beside = [](const Criterion& goal, const Criterion& other) {
    return other.kind == CriterionKind::kRequirement && other.metric == goal.metric &&
           ((goal.max && other.max && *other.max > *goal.max) || (goal.min && other.min && *other.min < *goal.min));
  };
  for (const auto& scenario : fs::directory_iterator(kConfig / "scenarios")) {
    const std::vector<Criterion> criteria = load_scenario(scenario.path(), machine_named()).criteria;
    for (const Criterion& goal : criteria) {
      if (goal.kind != CriterionKind::kGoal) continue;
      EXPECT_TRUE(std::ranges::any_of(criteria, [&](const Criterion& other) { return beside(goal, other); }))
          << scenario.path() << ": " << goal.metric;
    }
  }
}

TEST_F(ScenarioFile, EveryKeyIsNeededUnlessItIsMarkedOptional) {
  ASSERT_EQ(refusal(kWhole), "");
  std::istringstream lines(kWhole);
  int tried = 0;
  std::size_t at = 0;
  for (std::string line; std::getline(lines, line); at += line.size() + 1) {
    const auto equals = line.find(" = ");
    if (equals == std::string::npos) continue;
    std::string text = kWhole;
    text.erase(at, line.size());
    const bool optional = line.ends_with("#o");
    const std::string key = line.substr(0, equals), message = refusal(text);
    ++tried;
    if (optional) {
      EXPECT_EQ(message, "") << line;
    } else if (key == "break_force_N" || key == "joints_deg") {
      EXPECT_NE(message, "") << line;  // without them, others are unknown
    } else if (line == "max = 0.05" || key == "max") {
      EXPECT_TRUE(test::says(message, "neither min nor max"));
    } else {
      EXPECT_TRUE(test::says(message, key) && test::says(message, "missing"))
          << "without '" << line << "': " << message;
    }
  }
  EXPECT_GT(tried, 80);
}

TEST_F(ScenarioFile, SaysWhichCriteriaMustNeverBeMissedWhichMustNotGetWorseAndWhichAreGoals) {
  const auto criteria = load(kWhole).criteria;
  for (const auto& [metric, kind] : {std::pair{"faults", CriterionKind::kSafety},
                                     {"hold_error_N", CriterionKind::kCriterion},
                                     {"peak_N", CriterionKind::kRequirement},
                                     {"unfelt_s", CriterionKind::kGoal}}) {
    const auto found = std::ranges::find(criteria, metric, &Criterion::metric);
    ASSERT_NE(found, criteria.end()) << metric;
    EXPECT_EQ(found->kind, kind) << metric;
  }
}

TEST_F(ScenarioFile, IsRefusedByKeyValueAndBound) {
  expect_refused({
      {"duration_s = 60", "duration_s = 60\nduration_ms = 1", {"duration_ms", "unknown", "duration_s"}},
      {"felt_N = 2.0", "felt_N = 2.0\nspeed_radps = 1", {"speed_radps", "unknown"}},
      {"friction = 0.4", "friction = 0.4\nhunt_crossley = 1e8", {"hunt_crossley", "unknown"}},
      {"limb = \"normal\"", "limb = \"strong\"", {"limb", "strong", "light_grip"}},
      {"reaction_ms = 200", "reaction_ms = 601", {"reaction_ms", "601", "600"}},
      {"damping_ratio = 0.3", "damping_ratio = 1.1", {"damping_ratio", "1.1", "[0, 1]"}},
      {"direction = [0.5, 0]", "direction = [0, 0]", {"direction", "zero"}},
      {"felt_N = 2.0", "felt_N = nan", {"felt_N", "nan"}},
      {"detach_at_s = 40", "detach_at_s = 30", {"detach_at_s", "30", "34"}},
      {"to_m = 1", "to_m = -1", {"wall[0].to_m", "above from_m"}},
      {"kind = \"engage\"", "kind = \"fly\"", {"fly", "let_go"}},
      {"kind = \"wait\"", "kind = \"wander\"", {"phase[6].speed_radps", "missing"}},
      {"metric = \"tip_rms_m\"", "metric = \"tip_rms\"", {"tip_rms", "not a metric"}},
      {"metric = \"tip_rms_m\"\nmax = 0.05", "metric = \"tip_rms_m\"", {"criteria[0].metric", "neither min nor max"}},
      {"max = 0.05", "max = 0.05\nmin = 0.06", {"criteria[0].min", "0.06", "above max"}},
      {"metric = \"faults\"", "metric = \"peak_N\"", {"safety[0].metric", "peak_N", "resumed_by_itself"}},
  });
}

TEST_F(ScenarioFile, PosesThisMachineCannotTakeAreRefused) {
  expect_refused({
      {"tip_m = [2.2, 0.1]", "tip_m = [9, 0.1]", {"approach", "tip_m", "range", "solar015"}},
      {"bucket_deg = -75", "bucket_deg = 100", {"approach", "tip_m", "bucket would be at", "44.9"}},
      {"joints_deg = [40, -75, -40]", "joints_deg = [40, -20, -40]", {"home", "arm would be at -20 deg", "-29.2"}},
      {"start_deg = [40, -75, -40]", "start_deg = [80, -75, -40]", {"start_deg", "boom would be at 80 deg", "62.6"}},
      {"hand_deg = [42, -77, -38]", "hand_deg = [42, -77, 60]", {"hand_deg", "bucket would be at 60 deg"}},
  });
}

TEST_F(ScenarioFile, StartsInsideAWallOrBehindOneWithoutAnEndAreRefused) {
  const auto at = [](const std::string& x, bool with_ends) {
    const std::string rest = "normal = [-1, 0]\nstiffness_N_per_m = 1e6\ndamping_ratio = 0.3\nfriction = 0.4\n",
                      ends = "from_m = -1 #o\nto_m = 1 #o\n";
    return with("point_m = [2.55, 0.5]\n" + rest + ends,
                "point_m = [" + x + ", 0.5]\n" + rest + (with_ends ? ends : ""));
  };
  EXPECT_TRUE(
      test::says(refusal(at("2.0", true)), "key 'start_deg' = [40, -75, -40]: puts the bucket into or behind wall[0]"));
  EXPECT_TRUE(test::says(refusal(at("0.5", false)), "puts the bucket into or behind wall[0]"));
  EXPECT_EQ(refusal(at("0.5", true)), "") << "reached over";
  EXPECT_EQ(refusal(at("2.55", false)), "");
}

TEST_F(ScenarioFile, FaultsMustNameOnePhaseAndWhatCanHaveThem) {
  expect_refused({
      {"phase = \"sweep\"", "phase = \"swep\"", {"fault[0].phase", "swep", "no [[phase]]"}},
      {"name = \"rest\"", "name = \"sweep\"", {"fault[0].phase", "sweep", "more than one"}},
      {"kind = \"node_silent\"", "kind = \"valve_stuck\"", {"fault[0].joint", "missing"}},
      {"kind = \"node_silent\"", "kind = \"link_cut\"", {"fault[0].node", "unknown"}},
      {"kind = \"node_silent\"", "kind = \"gremlin\"", {"fault[0].kind", "gremlin", "link_cut", "babble"}},
      {"node = \"arm_head_pressure\"", "node = \"pressure_arm\"", {"fault[0].node", "arm_rod_pressure"}},
  });
  const auto fault = [](const std::string& kind, const std::string& node) {
    return with(
        "kind = \"node_silent\"\nphase = \"sweep\"\nafter_s = 2.3\nduration_s = 1.0\nnode = \"arm_head_pressure\"",
        "kind = \"" + kind + "\"\nphase = \"sweep\"\nafter_s = 2.3\nduration_s = 1.0\nnode = \"" + node + "\"");
  };
  EXPECT_TRUE(test::says(refusal(fault("sensor_invalid", "enable")), "the enable node cannot"));
  EXPECT_EQ(load(fault("sensor_frozen", "tilt")).faults[0].subject, machine_named().bus.tilt().id);
  EXPECT_EQ(load(fault("node_silent", "enable")).faults[0].subject, machine_named().bus.enable().id);
  EXPECT_EQ(load(fault("sensor_invalid", "bucket_rod_pressure")).faults[0].subject, machine_named().bus.pressure(5).id);
}

TEST_F(ScenarioFile, WithFaultsIsRefusedInRealTimeInTheWordsOfWhoRunsIt) {
  const Scenario scenario = load(kWhole);
  const std::string said = test::refusal([&] { refuse_faults(scenario); });
  EXPECT_TRUE(said.ends_with(": run it with knuckle simulate")) << said;
  EXPECT_EQ(test::refusal([&] { refuse_faults(scenario, ", without --realtime"); }), said + ", without --realtime");
}

TEST_F(ScenarioFile, EveryFaultIsReadByItsName) {
  const std::string node = "node = \"arm_head_pressure\"";
  int read = 0;
  for (int i = 0; i < sim::kFaultKinds; ++i) {
    const auto kind = static_cast<sim::FaultKind>(i);
    std::string text = with("kind = \"node_silent\"", std::string("kind = \"") + sim::name(kind) + "\"");
    if (sim::concerns_frame(kind)) continue;  // of a machine that sends some
    if (!sim::concerns_node(kind)) text.erase(text.find(node), node.size());
    if (sim::concerns_node(kind) && sim::why_not(kind, machine_named().bus.pressure(2).id, machine_named().bus))
      continue;
    EXPECT_EQ(load(text).faults[0].kind, kind) << sim::name(kind);
    ++read;
  }
  EXPECT_GT(read, 25) << "all but those of a valve or an encoder";
  EXPECT_EQ(load(kWhole).faults[0].kind, sim::FaultKind::kNodeSilent);
  EXPECT_EQ(load(kWhole).faults[1].kind, sim::FaultKind::kValveStuck);
  EXPECT_EQ(load(kWhole).faults[1].subject, machine_named().bus.valve(kArm).id);
}

TEST_F(ScenarioFile, FaultsOfFramesAreByTheFramesOrTheSignalsName) {
  const MachineDescription machine = knuckle::test::broadcast_machine();
  const auto read = [&](const std::string& kind, const std::string& frame) {
    std::string text = with("kind = \"node_silent\"", "kind = \"" + kind + "\"\nframe = \"" + frame + "\"");
    const std::string node = "node = \"arm_head_pressure\"";
    text.erase(text.find(node), node.size());
    return session::parse_scenario(text, "s.toml", machine).faults[0];
  };
  EXPECT_EQ(read("frame_silent", "front_angle").kind, sim::FaultKind::kFrameSilent);
  const auto whole = sim::subject_at(static_cast<std::size_t>(read("frame_frozen", "pressure_1").subject), machine.bus);
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->frame, 1U);
  EXPECT_EQ(whole->signals, ~std::uint64_t{0});
  const auto one = sim::subject_at(static_cast<std::size_t>(read("values_frozen", "arm_angle").subject), machine.bus);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->frame, 0U);
  EXPECT_EQ(std::popcount(one->signals), 1);
  for (const auto& [kind, frame, said] :
       {std::array<const char*, 3>{"frame_silent", "tail", "must be one of boom_head_pressure, "},
        {"frame_checksum", "front_angle", "the frame has no checksum"}}) {
    EXPECT_TRUE(test::says(test::refusal([&] { (void)read(kind, frame); }), said));
  }
  EXPECT_EQ(read("frame_checksum", "slope").kind, sim::FaultKind::kFrameChecksum);
}

TEST_F(ScenarioFile, PressingUntilItBreaksNeedsSomethingThatBreaks) {
  std::string text = with("hold_s = 10", "until_break = true");
  EXPECT_TRUE(load(text).phases[4].until_break);
  EXPECT_EQ(load(text).phases[4].pieces, 1);
  for (const char* key : {"break_force_N", "break_impulse_Ns", "piece_mass_kg", "piece_depth_m", "piece_rest_m"}) {
    const auto at = text.find(key);
    text.erase(at, text.find('\n', at) - at);
  }
  EXPECT_TRUE(test::says(refusal(text), "break_force_N"));
}

TEST_F(ScenarioFile, PhasesAreReadAsWritten) {
  const Scenario s = load(kWhole);
  ASSERT_EQ(s.phases.size(), 7U);
  EXPECT_EQ(s.phase_names[4], "press");
  EXPECT_EQ(s.phases[0].timeout_s, 20);
  EXPECT_EQ(s.phases[1].timeout_s, 30) << "unless said otherwise";
  EXPECT_TRUE(s.phases[1].until_fault);
  EXPECT_NEAR(s.phases[1].joints_rad[2], 22 * kDeg, 1e-12);
  EXPECT_FALSE(s.phases[2].joint_space);
  EXPECT_TRUE(s.phases[3].joint_space);
  EXPECT_EQ(s.phases[4].direction, PlanarVector(1, 0)) << "of length one";
  EXPECT_NEAR(s.phases[5].joints_rad[0], 5 * kDeg, 1e-12);
  const sim::Phase wander = load(with("kind = \"wait\"", "kind = \"wander\"\nspeed_radps = 0.6")).phases[6];
  EXPECT_EQ(wander.kind, sim::PhaseKind::kWander);
  EXPECT_EQ(wander.speed_mps, 0.6);
  EXPECT_EQ(wander.duration_s, 2);
  EXPECT_EQ(s.reaction, 200ms);
  EXPECT_EQ(s.delay_ms, 10);
}

TEST_F(ScenarioFile, LengthsFollowTheReachAndLoadsThePayload) {
  const Scenario small = load(kWhole, machine_named()), large = load(kWhole, machine_named("compact080"));
  const double length = 6.5 / 3.2, load = 800.0 / 150;
  EXPECT_NEAR(small.phases[2].tip_m.x(), 2.2, 1e-12);
  EXPECT_NEAR(large.phases[2].tip_m.x(), 2.2 * length, 1e-12);
  EXPECT_NEAR(large.phases[2].speed_mps, 0.3 * length, 1e-12);
  EXPECT_EQ(large.phases[2].bucket_rad, small.phases[2].bucket_rad) << "angles stay";
  EXPECT_EQ(large.phases[4].force_N, small.phases[4].force_N) << "the hand stays the same size";
  EXPECT_NEAR(large.world.walls[0].point_m.x(), 2.55 * length, 1e-12);
  EXPECT_NEAR(large.world.walls[0].to_m, 1 * length, 1e-12);
  EXPECT_NEAR(large.world.walls[0].break_force_N, 2200 * load, 1e-9);
  EXPECT_NEAR(large.world.walls[0].piece_mass_kg, 45 * load, 1e-9);
  EXPECT_EQ(large.world.walls[0].stiffness_N_per_m, 1e6) << "concrete is concrete";
  EXPECT_NEAR(large.world.soil[0].bucket_width_m, 0.45 * length, 1e-12);
  EXPECT_NEAR(large.world.soil[0].bucket_capacity_m3, 0.04 * load, 1e-12);
  EXPECT_NEAR(large.world.weights[0].mass_kg, 50 * load, 1e-9);
  EXPECT_EQ(large.world.weights[0].point_m, machine_named("compact080").payload_com_m);
  EXPECT_NEAR(large.world.pipes[0].radius_m, 0.05 * length, 1e-12);
  EXPECT_NEAR(large.criteria[1].max.value(), 0.05 * length, 1e-12);
  EXPECT_NEAR(large.criteria[2].max.value(), 5 * load, 1e-9);
  EXPECT_NEAR(large.criteria[3].max.value(), 150 * load, 1e-9);
  EXPECT_EQ(large.criteria[4].max.value(), 0.3) << "what the hand feels";
  EXPECT_NEAR(large.criteria[5].max.value(), 4000 * load, 1e-9);
}

}  // namespace
}  // namespace knuckle::session
