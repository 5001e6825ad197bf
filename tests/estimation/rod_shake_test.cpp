// Rods that shake on their oil by micrometres, from pressures alone.
#include "estimation/rod_shake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

constexpr double kStep_s = 0.005;

double stiffness_N_per_m(const MachineDescription& machine, const CylinderDescription& cylinder) {
  return oil_stiffness_N_per_m(cylinder, machine.hydraulics, (cylinder.min_length_m + cylinder.max_length_m) / 2);
}

/// Mean speed that is seen of rods that move by m(t).
template <typename Motion>
double seen_mps(int joint, const Motion& m, double noise_share = 0) {
  const MachineDescription machine = test_machine();
  RodShake shake(machine, kStep_s);
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  shake.reset(JointVector::Zero());
  double sum = 0;
  constexpr int kSettle = 200, kSteps = 4000;
  for (int k = 0; k < kSteps; ++k) {
    JointVector cylinder_N;
    for (int i = 0; i < kJoints; ++i) {
      const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
      const double noise_N =
          machine.sensors.pressure_noise_Pa * std::hypot(cylinder.head_area_m2(), cylinder.rod_side_area_m2());
      cylinder_N[i] =
          2e4 - stiffness_N_per_m(machine, cylinder) * m(k * kStep_s) + noise_share * noise_N * noise(random);
    }
    shake.step(cylinder_N);
    if (k >= kSettle) sum += shake.speed_mps(joint);
  }
  return sum / (kSteps - kSettle);
}

TEST(RodShake, ARingOfSomeMicrometresIsSeenAtItsSpeed) {
  constexpr double kRing_Hz = 5, kRing_m = 6e-5;
  const auto ring = [](double t_s) { return kRing_m * std::sin(2 * std::numbers::pi * kRing_Hz * t_s); };
  const double mean_mps = 4 * kRing_Hz * kRing_m;
  for (int joint = 0; joint < kJoints; ++joint) {
    EXPECT_GT(seen_mps(joint, ring, 1), 0.5 * mean_mps) << joint;
    EXPECT_LT(seen_mps(joint, ring, 1), mean_mps) << joint;
  }
}

TEST(RodShake, NoiseOfTransmittersIsTakenForLittle) {
  // Bristles turn over 0.1 mm: this much would release them in some ten seconds.
  for (int joint = 0; joint < kJoints; ++joint)
    EXPECT_LT(seen_mps(
                  joint, [](double) { return 0.0; }, 1),
              2e-5)
        << joint;
}

TEST(RodShake, WhatLeakageOrASlowPushMovesIsNoShaking) {
  const auto slow = [](double t_s) { return 2e-4 * std::sin(2 * std::numbers::pi * 0.1 * t_s); };
  for (int joint = 0; joint < kJoints; ++joint) EXPECT_LT(seen_mps(joint, slow), 1e-6) << joint;
}

TEST(RodShake, AStartAtAnyForceIsNoJolt) {
  RodShake shake(test_machine(), kStep_s);
  shake.reset({5e4, -3e4, 1e4});
  shake.step({5e4, -3e4, 1e4});
  for (int joint = 0; joint < kJoints; ++joint) EXPECT_EQ(shake.speed_mps(joint), 0) << joint;
}

}  // namespace
}  // namespace knuckle::estimation
