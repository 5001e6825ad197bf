// Rods that vibrate on their oil by less than encoders show, from pressures alone.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "estimation/observer.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

double stiffness_N_per_m(const MachineDescription& machine, const CylinderDescription& cylinder) {
  return oil_stiffness_N_per_m(cylinder, machine.hydraulics, (cylinder.min_length_m + cylinder.max_length_m) / 2);
}

/// Mean size of the speeds that are seen of rods that move by m(t).
template <typename Motion>
JointVector mean_seen_mps(const MachineDescription& machine, double step_s, const Motion& m, double noise_share = 0) {
  RodVibration vibration(machine, step_s);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, noise_share * machine.sensors.pressure_noise_Pa);
  vibration.reset(JointVector::Constant(2e4));
  JointVector sum = JointVector::Zero();
  const int settle = static_cast<int>(1 / step_s), steps = static_cast<int>(20 / step_s);
  for (int k = 0; k < steps; ++k) {
    JointVector cylinder_N;
    for (int i = 0; i < kJoints; ++i) {
      const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
      cylinder_N[i] = 2e4 - stiffness_N_per_m(machine, cylinder) * m(k * step_s) +
                      cylinder.head_area_m2() * noise(random) - cylinder.rod_side_area_m2() * noise(random);
    }
    vibration.step(cylinder_N);
    if (k >= settle) sum += vibration.speed_mps();
  }
  return sum / (steps - settle);
}

double standing(double) {
  return 0;
}

TEST(RodVibration, ARingBelowAnEncodersStepIsSeenAtItsSpeed) {
  constexpr double kRing_Hz = 5, kRing_m = 6e-5;
  const auto ring = [](double t_s) { return kRing_m * std::sin(2 * std::numbers::pi * kRing_Hz * t_s); };
  const double mean_mps = 4 * kRing_Hz * kRing_m;
  const JointVector seen_mps = mean_seen_mps(test_machine(), kStep_s, ring, 1);
  EXPECT_GT(seen_mps.minCoeff(), 0.5 * mean_mps) << seen_mps.transpose();
  EXPECT_LT(seen_mps.maxCoeff(), mean_mps) << seen_mps.transpose();
}

// Bristles turn over 0.1 mm: this much would release them in ten seconds.
TEST(RodVibration, NoiseOfTransmittersIsTakenForLittleAtEveryRate) {
  for (const double rate_Hz : {50.0, 100.0, 200.0, 250.0}) {
    const JointVector seen_mps = mean_seen_mps(test_machine(), 1 / rate_Hz, standing, 1);
    EXPECT_LT(seen_mps.maxCoeff(), 1e-5) << rate_Hz;
    EXPECT_GT(seen_mps.minCoeff(), 1.5e-6) << rate_Hz;
    EXPECT_GT(mean_seen_mps(test_machine(), 1 / rate_Hz, standing, 3).minCoeff(), 4e-5) << rate_Hz;
  }
}

TEST(RodVibration, ASingleStepOfATransmitterIsNone) {
  MachineDescription machine = test_machine();
  machine.sensors.pressure_noise_Pa = 0;
  machine.sensors.pressure_step_Pa = 5e5;
  RodVibration vibration(machine, kStep_s);
  vibration.reset(JointVector::Zero());
  for (int k = 0; k < 400; ++k) {
    JointVector cylinder_N;
    for (int i = 0; i < kJoints; ++i)
      cylinder_N[i] =
          k / 100 * machine.sensors.pressure_step_Pa * machine.cylinders[static_cast<std::size_t>(i)].head_area_m2();
    vibration.step(cylinder_N);
    EXPECT_TRUE(vibration.speed_mps().isZero()) << k;
  }
}

TEST(RodVibration, WhatLeakageOrASlowPushMovesIsNone) {
  const auto slow = [](double t_s) { return 3e-3 * std::sin(2 * std::numbers::pi * 0.1 * t_s); };
  EXPECT_TRUE(mean_seen_mps(test_machine(), kStep_s, slow).isZero());
}

}  // namespace
}  // namespace knuckle::estimation
