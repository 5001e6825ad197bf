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
  hold.wall_N_per_m = wall_N_per_m;
  return hold;
}

double border_of(const MachineDescription& machine, const ContactHold& hold, const ContactNominal& nominal = {}) {
  return ContactLoop(machine, hold, nominal).border().value_or(ContactCrossing{}).stiffness_N_per_m;
}

TEST(ContactLoop, AnIntegratorWithDeadTimeSwingsWhereItsClosedFormSays) {
  // B = -k e^(-j w T) / (j w) is real and positive first at w = pi / (2 T), where it is 2 k T / pi.
  const double k = 4e5, dead_time_s = 0.1;
  const auto found = swing_border([&](double w) -> std::array<Complex, 2> {
    return {-k * std::polar(1.0, -w * dead_time_s) / Complex(0, w), Complex(0, 0)};
  });
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->frequency_Hz, 1 / (4 * dead_time_s), 0.01 / (4 * dead_time_s));
  EXPECT_NEAR(found->stiffness_N_per_m, 2 * k * dead_time_s / std::numbers::pi, 0.01 * k * dead_time_s);
}

TEST(ContactLoop, AnIntegratorAloneNeverSwings) {
  const auto found = swing_border([](double w) -> std::array<Complex, 2> {
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

TEST(ContactLoop, DeadZonePassesNothingThatItIsWiderThanAndNearlyAllThatIsMuchLarger) {
  EXPECT_EQ(dead_zone_gain(2, 1), 0);
  EXPECT_EQ(dead_zone_gain(0, 1), 1);
  EXPECT_NEAR(dead_zone_gain(1, 2), 1 - 2 / std::numbers::pi * (std::asin(0.5) + 0.5 * std::sqrt(0.75)), 1e-12);
  EXPECT_GT(dead_zone_gain(1, 100), 0.98);
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

TEST(ContactLoop, TheDeadBandForgivesSmallSwingsFirst) {
  const MachineDescription machine = solar();
  const ContactLoop loop(machine, hold_of(pose_named(machine, "front"), 1e7));
  const double linear = loop.border().value().stiffness_N_per_m;
  double before = 0;
  for (const double swing_N : {200.0, 1000.0, 5000.0, 1e5}) {
    const double border = loop.border_with_dead_band(swing_N).value().stiffness_N_per_m;
    EXPECT_GT(border, before);
    EXPECT_LT(border, linear);
    before = border;
  }
  EXPECT_GT(before, 0.95 * linear);
  EXPECT_FALSE(loop.lasting_swing_N(1.05 * linear)) << "a stiffer law than the border calms down after any swing";
  EXPECT_TRUE(loop.lasting_swing_N(0.7 * linear));
}

TEST(ContactLoop, ThePhaseMarginIsGoneAtTheBorder) {
  const MachineDescription machine = solar();
  const ContactLoop loop(machine, hold_of(pose_named(machine, "ground"), 1e7));
  const double border = loop.border().value().stiffness_N_per_m;
  EXPECT_NEAR(loop.margins(border).value().phase_margin_deg, 0, 3);
  EXPECT_GT(loop.margins(2 * border).value().phase_margin_deg, 15);
  EXPECT_LT(loop.margins(border / 2).value().phase_margin_deg, -15);
}

/// The simulated machine with its real slave loop, on both sides of the border that the model finds for its hold.
TEST(ContactLoop, TheSimulatedMachineIsCalmAboveTheBorderAndSwingsBelow) {
  const MachineDescription machine = solar();
  for (const char* name : {"ground", "pull"}) {
    SCOPED_TRACE(name);
    ContactTrial trial = trial_of(machine, {pose_named(machine, name), 1e7}, Valves::kIdeal, 1);
    trial.machine.control.tip_stiffness_N_per_m = 3e5;
    const HoldSwing stiff = judge_hold(trial, run_contact(trial));
    ASSERT_TRUE(stiff.calm);
    const double border = border_of(trial.machine, stiff.hold);
    trial.machine.control.tip_stiffness_N_per_m = border / 0.7;
    EXPECT_TRUE(judge_hold(trial, run_contact(trial)).calm);
    trial.machine.control.tip_stiffness_N_per_m = border / 1.4;
    const HoldSwing swings = judge_hold(trial, run_contact(trial));
    EXPECT_FALSE(swings.calm);
    EXPECT_NEAR(swings.frequency_Hz, ContactLoop(trial.machine, stiff.hold).border()->frequency_Hz, 0.5);
  }
}

TEST(ContactLoop, OneSmallSignalBorderOutsideTheBoundFailsTheStudy) {
  const MachineDescription machine = solar();
  ContactRow met;
  met.cell = {pose_named(machine, "front"), 1e7};
  met.small = {1e5, 2.6, ContactCrossing{1.2e5, 2.6}};
  met.large = {1e5, 2.6, ContactCrossing{3e5, 2.6}};  // reported, but no bound
  ContactRow missed = met, silent = met;
  missed.small.predicted->stiffness_N_per_m = 1.26e5;
  silent.small.predicted.reset();
  EXPECT_TRUE(all_within_bound({met}));
  EXPECT_FALSE(all_within_bound({met, missed}));
  EXPECT_FALSE(all_within_bound({silent})) << "a border that is not predicted is not met";

  std::ostringstream text;
  write_contact_rows({met, missed}, machine, text);
  const auto json = nlohmann::json::parse(text.str());
  EXPECT_EQ(json["schema"], kContactLoopSchema);
  EXPECT_EQ(json["passed"], false);
  EXPECT_NEAR(json["rows"][1]["small_signal"]["ratio"].get<double>(), 1.26, 1e-9);
}

}  // namespace
}  // namespace knuckle::studies
