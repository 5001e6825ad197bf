// The families that machines are sampled from: what one of each has, and that the plant can be built of it and stands.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "sim/haptic_device.h"
#include "sim/plant.h"
#include "sim/rigid_body.h"
#include "tests/master/desk.h"
#include "tests/sim/test_plant.h"

namespace knuckle::sim {
namespace {

constexpr int kMachines = 40;

/// Share of values in the outer quarters of their range.
double outer_share(const std::vector<double>& values, double low, double high) {
  const double middle = 0.5 * (low + high), quarter = 0.25 * (high - low);
  const auto outer =
      std::count_if(values.begin(), values.end(), [&](double v) { return std::abs(v - middle) > quarter; });
  return static_cast<double>(outer) / static_cast<double>(values.size());
}

TEST(Population, ASmoothMachineHasNoneOfTheRougherEffects) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const MachineTruth smooth = sample_truth(test::solar(), Family::kSmooth, seed);
    EXPECT_FALSE(smooth.pin[kBoom].compliant());
    EXPECT_EQ(smooth.hull.stiffness_N_per_m, 0);
    EXPECT_EQ(smooth.valve[kArm].curve_exponent, 1);
    EXPECT_EQ(smooth.valve[kArm].leakage_m3ps_per_Pa, 0);
    EXPECT_EQ(smooth.friction[kArm].seal_N_per_Pa, 0);
    EXPECT_EQ(smooth.pump.ripple_Pa + smooth.pump.regulator_Hz + smooth.cross_talk, 0);
    EXPECT_NE(smooth.pressure[0].offset_Pa, 0) << "but it is not its drawing either";
  }
}

TEST(Population, AWornMachineIsRougherThanAServicedOneInEveryRespect) {
  for (std::uint64_t seed = 1; seed <= kMachines; ++seed) {
    const MachineTruth serviced = sample_truth(test::solar(), Family::kServiced, seed);
    const MachineTruth worn = sample_truth(test::solar(), Family::kWorn, seed);
    for (std::size_t i = 0; i < kJoints; ++i) {
      EXPECT_LE(serviced.valve[i].curve_exponent, worn.valve[i].curve_exponent);
      EXPECT_LT(serviced.valve[i].stiction, worn.valve[i].stiction);
      EXPECT_LT(serviced.machine.cylinders[i].valve.hysteresis, worn.machine.cylinders[i].valve.hysteresis);
      EXPECT_LT(serviced.friction[i].seal_N_per_Pa, worn.friction[i].seal_N_per_Pa);
      EXPECT_LE(serviced.friction[i].pin_share, worn.friction[i].pin_share);
      EXPECT_LT(serviced.pin[i].play_m, worn.pin[i].play_m);
      EXPECT_GT(serviced.pin[i].stiffness_N_per_m, 1.5 * worn.pin[i].stiffness_N_per_m);
    }
    EXPECT_GT(serviced.hull.stiffness_N_per_m, worn.hull.stiffness_N_per_m);
    EXPECT_LE(serviced.cross_talk, worn.cross_talk);
    EXPECT_LE(serviced.pump.ripple_Pa, worn.pump.ripple_Pa);
    EXPECT_GT(serviced.pump.regulator_damping, worn.pump.regulator_damping);
  }
}

TEST(Population, OfAWornFamilyMostAreNearItsBounds) {
  std::vector<double> serviced, worn;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    serviced.push_back(sample_truth(test::solar(), Family::kServiced, seed).tilt_offset_rad);
    worn.push_back(sample_truth(test::solar(), Family::kWorn, seed).tilt_offset_rad);
  }
  const double half = 0.5 * std::numbers::pi / 180;
  EXPECT_NEAR(outer_share(serviced, -half, half), 0.5, 0.1);          // uniform
  EXPECT_NEAR(outer_share(worn, -2 * half, 2 * half), 2.0 / 3, 0.1);  // arcsine
}

TEST(Population, SteelBendsAtTheTipAsMuchAsSteelDoes) {
  // The sum of the three springs' give at the tip of the stretched arm, per unit of force across it.
  for (const Family family : {Family::kServiced, Family::kWorn}) {
    const MachineTruth truth = sample_truth(test::solar(), family, 3);
    JointVector middle;
    for (std::size_t i = 0; i < kJoints; ++i) {
      const LinkDescription& link = test::solar().links[i];
      middle[static_cast<Eigen::Index>(i)] = 0.5 * (link.min_rad + link.max_rad);
    }
    const JointVector lever_m = RigidBody(test::solar(), 0).pose(middle).lever_m;
    double give_m_per_N = 0, out_m = 0;
    for (int i = kJoints - 1; i >= 0; --i) {
      out_m += test::solar().links[static_cast<std::size_t>(i)].length_m;
      const double ratio = out_m / lever_m[i];
      give_m_per_N += ratio * ratio / truth.pin[static_cast<std::size_t>(i)].stiffness_N_per_m;
    }
    EXPECT_NEAR(give_m_per_N, family == Family::kWorn ? 6.5e-6 : 3e-6, 0.3e-6);
  }
}

TEST(Population, EveryMachineStandsAndMovesWithoutComingApart) {
  for (const Family family : {Family::kServiced, Family::kWorn}) {
    for (std::uint64_t seed = 1; seed <= kMachines / 4; ++seed) {
      SCOPED_TRACE(std::string(name(family)) + " " + std::to_string(seed));
      Plant plant(sample_truth(test::solar(), family, seed), {}, kWorkingPose);
      plant.set_pilot(true);
      run(plant, 0.5);
      EXPECT_LT((plant.state().joint_rad - kWorkingPose).norm(), 0.02) << "stands";
      double fastest_radps = 0, fastest_mps = 0;
      for (int k = 0; k < 2000; ++k) {
        const double t = k * 1e-3;
        demand(plant, 0.9 * JointVector(std::sin(3 * t), std::sin(4 * t), std::sin(5 * t)));
        plant.step(std::chrono::milliseconds(1));
        ASSERT_TRUE(plant.state().joint_rad.allFinite());
        fastest_radps = std::max(fastest_radps, plant.state().joint_radps.cwiseAbs().maxCoeff());
        fastest_mps = std::max(fastest_mps, plant.state().cylinder_mps.cwiseAbs().maxCoeff());
      }
      EXPECT_GT(fastest_radps, 0.05) << "moves";
      EXPECT_LT(fastest_radps, 6);
      EXPECT_LT(fastest_mps, 2) << "rods on their pins as well";
      EXPECT_LT(std::abs(plant.state().hull_pitch_rad), 0.1);
    }
  }
}

TEST(Population, DevicesHaveTheErrorsOfTheirFamily) {
  const DeviceDescription nominal = test::desk_device();
  double most_serviced = 0, most_worn = 0;
  for (std::uint64_t seed = 1; seed <= kMachines; ++seed) {
    EXPECT_EQ(sample_device(nominal, Family::kSmooth, seed).built.zero_counts[0], nominal.zero_counts[0]);
    const DeviceTruth serviced = sample_device(nominal, Family::kServiced, seed);
    const DeviceTruth worn = sample_device(nominal, Family::kWorn, seed);
    const auto gain_error = [&](const DeviceTruth& truth) {
      return std::abs(truth.built.torque_constant_Nm_per_A[1] / nominal.torque_constant_Nm_per_A[1] - 1);
    };
    most_serviced = std::max(most_serviced, gain_error(serviced));
    most_worn = std::max(most_worn, gain_error(worn));
    EXPECT_EQ(worn.described.torque_constant_Nm_per_A, nominal.torque_constant_Nm_per_A) << "it reports its file's";
    EXPECT_EQ(worn.described.zero_counts, nominal.zero_counts);
    EXPECT_NE(worn.built.zero_counts, nominal.zero_counts);
    EXPECT_EQ(serviced.backlash_rad.norm(), 0);
    EXPECT_GT(worn.backlash_rad.minCoeff(), 0);
    EXPECT_GE(worn.built.friction_Nm[2], nominal.friction_Nm[2]);
  }
  EXPECT_GT(most_serviced, 0.015);
  EXPECT_LE(most_serviced, 0.03 + 1e-12);
  EXPECT_GT(most_worn, 0.05);
  EXPECT_LE(most_worn, 0.1 + 1e-12);
}

}  // namespace
}  // namespace knuckle::sim
