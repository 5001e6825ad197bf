// The linear model of the contact loop: closed-form limits, which way parameters move its border, and the border
// against the simulated machine.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <sstream>

#include "app/studies/contact_table.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

using Complex = std::complex<double>;

MachineDescription solar() {
  return load_machine(find_config("machine", "solar015"));
}

ContactPose pose_named(const MachineDescription& machine, const std::string& name) {
  for (const ContactPose& pose : contact_poses(machine)) {
    if (pose.name == name) return pose;
  }
  throw std::invalid_argument("no pose " + name);
}

/// A hold in a pose, its chambers at pressures that a machine of this size has.
ContactHold hold_of(const ContactPose& pose, double wall_N_per_m) {
  ContactHold hold;
  hold.joint_rad = pose.joint_rad;
  hold.chamber_Pa = {60e5, 20e5, 20e5, 50e5, 20e5, 40e5};
  hold.normal = pose.normal;
  hold.place_m = pose.place_m;
  hold.force_N = 1800 * pose.normal;
  hold.wall_N_per_m = wall_N_per_m;
  return hold;
}

double border_of(const MachineDescription& machine, const ContactHold& hold, const ContactNominal& nominal = {}) {
  return stiffness_border(machine, hold, nominal).value_or(PredictedBorder{}).value;
}

TEST(ContactLoop, AnIntegratorWithDeadTimeSwingsWhereItsClosedFormSays) {
  // B = -k e^(-j w T) / (j w) is real and positive first at w = pi / (2 T), where it is 2 k T / pi.
  const double k = 4e5, dead_time_s = 0.1;
  const auto found = largest_crossing([&](double w) -> std::array<Complex, 2> {
    return {-k * std::polar(1.0, -w * dead_time_s) / Complex(0, w), Complex(0, 0)};
  });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->frequency_Hz, 1 / (4 * dead_time_s), 0.01 / (4 * dead_time_s));
  EXPECT_NEAR(found->gain, 2 * k * dead_time_s / std::numbers::pi, 0.01 * k * dead_time_s);
}

TEST(ContactLoop, AnIntegratorAloneNeverSwings) {
  const auto found = largest_crossing([](double w) -> std::array<Complex, 2> {
    return {-1e5 / Complex(0, w), Complex(0, 0)};
  });
  EXPECT_FALSE(found);
}

TEST(ContactLoop, WithoutAWallThereIsNothingToGiveWayTo) {
  const MachineDescription machine = solar();
  ContactHold hold = hold_of(pose_named(machine, "front"), 1e-3);
  hold.sticks = false;
  hold.wall_damping_ratio = 0;
  EXPECT_LT(border_of(machine, hold), 1e-2);
}

/// Seeded: any pose within the middle of the joints' ranges, any wall, pressures, directions.
TEST(ContactLoop, LagsAndOilMoveTheBorderAsTheyShould) {
  const MachineDescription machine = solar();
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  const auto between = [&](double low, double high) {
    return low + (high - low) * std::uniform_real_distribution<>(0, 1)(random);
  };
  for (int draw = 0; draw < 12; ++draw) {
    ContactPose pose = contact_poses(machine)[static_cast<std::size_t>(draw) % 5];
    for (int i = 0; i < kJoints; ++i) pose.joint_rad[i] += between(-0.1, 0.1);
    ContactHold hold = hold_of(pose, std::pow(10, between(6, 8)));
    for (double& pressure_Pa : hold.chamber_Pa) pressure_Pa = between(10e5, 90e5);
    SCOPED_TRACE(pose.name + " draw " + std::to_string(draw));
    const double border = border_of(machine, hold);
    ASSERT_GT(border, 0);

    MachineDescription later = machine, slower = machine, softer = machine;
    for (CylinderDescription& cylinder : later.cylinders) cylinder.valve.delay_s += 0.02;
    for (CylinderDescription& cylinder : slower.cylinders) cylinder.valve.natural_frequency_Hz /= 2;
    softer.hydraulics.bulk_modulus_Pa /= 2;
    EXPECT_GT(border_of(later, hold), border) << "a longer dead time must need a stiffer law";
    EXPECT_GT(border_of(slower, hold), border) << "a slower spool must need a stiffer law";
    EXPECT_LT(border_of(softer, hold), border) << "softer oil builds force more slowly";
  }
}

TEST(ContactLoop, ThePhaseMarginIsGoneAtTheBorder) {
  MachineDescription machine = solar();
  const ContactHold hold = hold_of(pose_named(machine, "ground"), 1e7);
  const double border = border_of(machine, hold);
  machine.control.contact_crossover_radps = kNoBound_radps;
  const auto margin_deg = [&](double stiffness_N_per_m) {
    machine.control.tip_stiffness_N_per_m = stiffness_N_per_m;
    return ContactLoop(machine, hold).margins().value().phase_margin_deg;
  };
  EXPECT_NEAR(margin_deg(border), 0, 3);
  EXPECT_GT(margin_deg(2 * border), 15);
  EXPECT_LT(margin_deg(border / 2), -15);
}

/// A law that is softer is slowed by as much, and so is one whose oil is stiffer: what then still changes the gain is
/// the way back to the set-point, which is slowed as well.
TEST(ContactLoop, WhereTheBoundActsNeitherKsNorTheOilOfTheFileMovesTheLoop) {
  const MachineDescription machine = solar();
  const ContactHold hold = hold_of(pose_named(machine, "back"), 1e8);
  const auto gain = [&](const MachineDescription& changed) { return ContactLoop(changed, hold).crossing()->gain; };
  MachineDescription softer_law = machine, softer_oil = machine, slower = machine;
  softer_law.control.tip_stiffness_N_per_m /= 2;
  softer_oil.hydraulics.bulk_modulus_Pa /= 1.5;
  slower.control.contact_crossover_radps /= 2;
  EXPECT_NEAR(gain(softer_law) / gain(machine), 1, 0.2);
  EXPECT_NEAR(gain(softer_oil) / gain(machine), 1, 0.1);
  EXPECT_NEAR(gain(slower) / gain(machine), 0.5, 0.15);
}

TEST(ContactLoop, TheLargestCrossoverIsWhereTheGainIsOne) {
  MachineDescription machine = solar();
  for (const char* name : {"front", "tilted", "back"}) {
    const ContactHold hold = hold_of(pose_named(machine, name), 1e8);
    const auto border = crossover_border(machine, hold);
    ASSERT_TRUE(border) << name;
    machine.control.contact_crossover_radps = border->value;
    EXPECT_NEAR(ContactLoop(machine, hold).crossing()->gain, 1, 0.02) << name;
  }
  EXPECT_FALSE(crossover_border(machine, hold_of(pose_named(machine, "pull"), 1e8)))
      << "there Ks alone keeps the loop calm";
}

/// Without bound, and at the back of the bucket: the touched point gives way, so its oil is what is felt, not the
/// tip's.
TEST(ContactLoop, TheBackOfTheBucketAsksForAStifferLawThanItsTip) {
  const MachineDescription machine = solar();
  ContactHold hold = hold_of(pose_named(machine, "back"), 1e8);
  const double back = border_of(machine, hold);
  hold.place_m = PlanarVector(machine.links[kBucket].length_m, 0);
  EXPECT_GT(back, 1.3 * border_of(machine, hold));
}

/// Far beyond the border the swing leaves the wall, and its frequency is no longer that of a linear loop.
constexpr double kJustBeyond = 1.1;

/// The simulated machine with its real slave loop, on both sides of the border that the model finds for its hold.
TEST(ContactLoop, TheSimulatedMachineIsCalmAboveTheBorderOfKsAndSwingsBelow) {
  const MachineDescription machine = solar();
  for (const char* name : {"ground", "pull"}) {
    SCOPED_TRACE(name);
    ContactTrial trial = trial_of(machine, {pose_named(machine, name), 1e7}, Valves::kIdeal, 1);
    const HoldSwing at_file = judge_hold(trial, run_contact(trial));
    ASSERT_TRUE(at_file.calm);
    const auto border = stiffness_border(trial.machine, at_file.hold);
    ASSERT_TRUE(border);
    trial.machine.control.contact_crossover_radps = kNoBound_radps;
    trial.machine.control.tip_stiffness_N_per_m = border->value / 0.8;
    EXPECT_TRUE(judge_hold(trial, run_contact(trial)).calm);
    trial.machine.control.tip_stiffness_N_per_m = border->value / 1.25;
    EXPECT_FALSE(judge_hold(trial, run_contact(trial)).calm);
    trial.machine.control.tip_stiffness_N_per_m = border->value / kJustBeyond;
    EXPECT_NEAR(judge_hold(trial, run_contact(trial)).frequency_Hz, border->frequency_Hz, 0.3);
  }
}

TEST(ContactLoop, TheSimulatedMachineIsCalmBelowTheBorderOfTheCrossoverAndSwingsAbove) {
  const MachineDescription machine = solar();
  for (const char* name : {"front", "tilted"}) {
    SCOPED_TRACE(name);
    ContactTrial trial = trial_of(machine, {pose_named(machine, name), 1e8}, Valves::kIdeal, 1);
    const HoldSwing at_file = judge_hold(trial, run_contact(trial));
    ASSERT_TRUE(at_file.calm);
    const auto border = crossover_border(trial.machine, at_file.hold);
    ASSERT_TRUE(border);
    EXPECT_GT(border->value, 1.5 * machine.control.contact_crossover_radps) << "margin of the file";
    trial.machine.control.contact_crossover_radps = 0.8 * border->value;
    EXPECT_TRUE(judge_hold(trial, run_contact(trial)).calm);
    trial.machine.control.contact_crossover_radps = 1.25 * border->value;
    EXPECT_FALSE(judge_hold(trial, run_contact(trial)).calm);
    trial.machine.control.contact_crossover_radps = kJustBeyond * border->value;
    EXPECT_NEAR(judge_hold(trial, run_contact(trial)).frequency_Hz, border->frequency_Hz, 0.3);
  }
}

TEST(ContactLoop, OneBorderOutsideTheBoundOrOneHoldThatSwingsFailsTheStudy) {
  const MachineDescription machine = solar();
  HoldSwing calm;
  calm.calm = true;
  ContactRow met;
  met.cell = {pose_named(machine, "front"), 1e7};
  met.small_at_file = met.on_file = calm;
  met.stiffness = {{true, 1e5, 2.6, calm}, PredictedBorder{1.2e5, 2.6}};
  met.crossover = {{false, 0, 0, calm}, {}};
  EXPECT_TRUE(all_passed({met})) << "no border measured and none predicted";
  ContactRow missed = met, silent = met, feared = met, swings = met;
  missed.stiffness.predicted->value = 1.26e5;
  silent.stiffness.predicted.reset();
  feared.crossover.predicted = PredictedBorder{20, 2.6};
  swings.on_file.calm = false;
  EXPECT_FALSE(all_passed({met, missed}));
  EXPECT_FALSE(all_passed({silent})) << "a border that is not predicted is not met";
  EXPECT_FALSE(all_passed({feared})) << "nor is one that is predicted where there is none";
  EXPECT_FALSE(all_passed({swings}));

  std::ostringstream text;
  write_contact_rows({met, missed}, machine, text);
  const auto json = nlohmann::json::parse(text.str());
  EXPECT_EQ(json["schema"], kContactLoopSchema);
  EXPECT_EQ(json["passed"], false);
  EXPECT_EQ(json["rows"][0]["passed"], true);
  EXPECT_TRUE(json["rows"][0]["crossover_border_radps"]["measured"].is_null());
  EXPECT_NEAR(json["rows"][1]["stiffness_border_N_per_m"]["predicted"].get<double>(), 1.26e5, 1e-6);
}

}  // namespace
}  // namespace knuckle::studies
