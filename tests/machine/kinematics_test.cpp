// Linkages and chain of both shipped machines, and what is refused as geometry.
#include "machine/kinematics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/no_alloc.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/shipped.h"

namespace knuckle {
namespace {

constexpr int kSweep = 2000;

double swept(const MachineDescription& machine, int joint, int i) {
  const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
  return link.min_rad + (link.max_rad - link.min_rad) * i / kSweep;
}

std::string geometry_refusal(const MachineDescription& machine) {
  return test::refusal([&] { const Kinematics kinematics(machine); });
}

class KinematicsOf : public ::testing::TestWithParam<const char*> {
 protected:
  const MachineDescription machine_ = test::shipped(GetParam());
  const Kinematics kinematics_{machine_};
};
INSTANTIATE_TEST_SUITE_P(ShippedMachines, KinematicsOf, ::testing::Values("solar015", "compact080", "standard200"),
                         [](const auto& chosen) { return std::string(chosen.param); });

TEST_P(KinematicsOf, RoundTripsAngleAndLengthOverTheWorkingRange) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (int i = 0; i <= kSweep; ++i) {
      const double angle = swept(machine_, joint, i);
      const auto back = kinematics_.joint_at(joint, kinematics_.cylinder_at(joint, angle)->length_m);
      ASSERT_TRUE(back) << kJointNames[static_cast<std::size_t>(joint)] << " at " << angle;
      ASSERT_NEAR(*back, angle, 1e-12) << kJointNames[static_cast<std::size_t>(joint)];
    }
  }
}

TEST_P(KinematicsOf, LeverIsTheDerivativeOfTheLength) {
  constexpr double kStep = 1e-4;
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto difference = [&](double angle, double step) {
      return (kinematics_.cylinder_at(joint, angle + step)->length_m -
              kinematics_.cylinder_at(joint, angle - step)->length_m) /
             (2 * step);
    };
    for (int i = 0; i <= kSweep; ++i) {
      const double angle = swept(machine_, joint, i);
      const double expected = (4 * difference(angle, kStep) - difference(angle, 2 * kStep)) / 3;
      ASSERT_NEAR(kinematics_.cylinder_at(joint, angle)->lever_m, expected, 1e-10) << joint << " at " << angle;
    }
  }
}

TEST_P(KinematicsOf, BucketCrankStaysOnItsSide) {
  MachineDescription mirrored = machine_;
  mirrored.bucket_linkage.branch = -1;
  EXPECT_NE(geometry_refusal(mirrored), "accepted") << "the other side is not a machine";
  double last = kinematics_.cylinder_at(kBucket, swept(machine_, kBucket, 0))->length_m;
  const double step = swept(machine_, kBucket, 1) - swept(machine_, kBucket, 0);
  for (int i = 1; i <= kSweep; ++i) {
    const double length = kinematics_.cylinder_at(kBucket, swept(machine_, kBucket, i))->length_m;
    ASSERT_LT(length, last) << "extending curls the bucket in, without a jump";
    ASSERT_GT(length, last - 0.5 * step) << "no lever is half a metre long";
    last = length;
  }
}

TEST_P(KinematicsOf, HasNoAngleForLengthsOutsideTheRange) {
  for (int joint = 0; joint < kJoints; ++joint) {
    const double a = kinematics_.cylinder_at(joint, swept(machine_, joint, 0))->length_m;
    const double b = kinematics_.cylinder_at(joint, swept(machine_, joint, kSweep))->length_m;
    const double margin = 0.2 * std::abs(a - b);
    EXPECT_FALSE(kinematics_.joint_at(joint, std::min(a, b) - margin));
    EXPECT_FALSE(kinematics_.joint_at(joint, std::max(a, b) + margin));
    EXPECT_FALSE(kinematics_.joint_at(joint, -a));
    EXPECT_FALSE(kinematics_.joint_at(joint, std::numeric_limits<double>::quiet_NaN()));
    EXPECT_FALSE(kinematics_.joint_at(joint, std::numeric_limits<double>::infinity()));
  }
}

TEST_P(KinematicsOf, HasAnAngleForEveryLengthOfTheStrokeUpToTheToggle) {
  constexpr double kStep_m = 1e-4, kShort_m = 0.010;
  for (int joint = 0; joint < kJoints; ++joint) {
    const CylinderDescription& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
    const double middle_m = kinematics_.cylinder_at(joint, swept(machine_, joint, kSweep / 2))->length_m;
    for (const double direction : {-1.0, 1.0}) {
      const double end_m = direction < 0 ? cylinder.min_length_m : cylinder.max_length_m;
      double lever_m = 1;
      for (double length = middle_m; direction * (end_m - length) >= 0; length += direction * kStep_m) {
        const auto angle = kinematics_.joint_at(joint, length);
        if (!angle && lever_m < kShort_m) break;
        ASSERT_TRUE(angle) << joint << " at " << length << " m of " << end_m << ", lever " << lever_m;
        const auto back = kinematics_.cylinder_at(joint, *angle);
        ASSERT_NEAR(back->length_m, length, 1e-10) << joint;
        lever_m = std::abs(back->lever_m);
      }
    }
  }
}

TEST_P(KinematicsOf, JacobianIsTheDerivativeOfTheTip) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (int i = 0; i < 200; ++i) {
    const JointVector joints(angle(random), angle(random), angle(random));
    const auto jacobian = kinematics_.tip_jacobian(joints);
    for (int j = 0; j < kJoints; ++j) {
      constexpr double kStep = 1e-5;
      const JointVector change = kStep * JointVector::Unit(j);
      const PlanarVector expected = (kinematics_.tip(joints + change) - kinematics_.tip(joints - change)) / (2 * kStep);
      ASSERT_LT((jacobian.col(j) - expected).norm(), 1e-8) << joints.transpose();
    }
  }
}

TEST_P(KinematicsOf, InverseFindsTheJointsOfEveryTip) {
  std::mt19937 random(12);
  std::uniform_int_distribution<int> pick(0, kSweep);
  for (int i = 0; i < 1000; ++i) {
    const JointVector joints(swept(machine_, kBoom, pick(random)), swept(machine_, kArm, pick(random)),
                             swept(machine_, kBucket, pick(random)));
    const auto back = kinematics_.inverse(kinematics_.tip(joints), joints.sum());
    ASSERT_TRUE(back) << joints.transpose();
    ASSERT_LT((*back - joints).norm(), 1e-10) << joints.transpose();
  }
  const double reach = machine_.links[0].length_m + machine_.links[1].length_m + machine_.links[2].length_m;
  EXPECT_FALSE(kinematics_.inverse(PlanarVector(reach + 0.01, 0), 0));
  EXPECT_FALSE(kinematics_.inverse(PlanarVector(machine_.links[2].length_m, 0), 0)) << "bucket pin on the boom pin";
  EXPECT_FALSE(kinematics_.inverse(PlanarVector(std::nan(""), 0), 0));
}

TEST_P(KinematicsOf, AllocatesNothing) {
  const test::NoAllocScope scope;
  double sum = 0;
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto cylinder = kinematics_.cylinder_at(joint, swept(machine_, joint, kSweep / 2));
    sum += *kinematics_.joint_at(joint, cylinder->length_m);
  }
  const JointVector joints(0.3, -1.5, -0.8);
  sum += kinematics_.inverse(kinematics_.tip(joints), joints.sum())->sum() + kinematics_.tip_jacobian(joints).sum();
  EXPECT_EQ(scope.allocations(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

// Figures worked out by hand from the published pin positions.
TEST(Kinematics, DefaultMachineHasThePublishedLengthsAndLeverSigns) {
  const Kinematics kinematics(test::shipped("solar015"));
  EXPECT_NEAR(kinematics.cylinder_at(kBoom, -0.474)->length_m, 0.7728, 1e-4);
  EXPECT_NEAR(kinematics.cylinder_at(kBoom, 1.092)->length_m, 1.1144, 1e-4);
  EXPECT_NEAR(kinematics.cylinder_at(kArm, -2.585)->length_m, 1.3282, 1e-4);
  EXPECT_NEAR(kinematics.cylinder_at(kArm, -0.510)->length_m, 0.8926, 1e-4);
  EXPECT_NEAR(kinematics.cylinder_at(kBucket, -2.5)->length_m, 1.0760, 1e-4);
  EXPECT_NEAR(kinematics.cylinder_at(kBucket, 0.784)->length_m, 0.7794, 1e-4);
  EXPECT_GT(kinematics.cylinder_at(kBoom, 0.3)->lever_m, 0.13);
  EXPECT_LT(kinematics.cylinder_at(kArm, -1.5)->lever_m, -0.12);
  EXPECT_LT(kinematics.cylinder_at(kBucket, -0.8)->lever_m, -0.1);
}

TEST(Kinematics, RefusesALinkageThatCannotCloseWithTheAngle) {
  MachineDescription machine = test::shipped("solar015");
  machine.bucket_linkage.coupler_length_m = 0.10;
  const std::string line = geometry_refusal(machine);
  EXPECT_TRUE(test::says(line, "solar015.toml: key 'links.bucket.min_rad' = "));
  EXPECT_TRUE(test::says(line, "the linkage cannot close at "));
}

TEST(Kinematics, RefusesARangeThatPassesAToggleWithTheLever) {
  for (const auto& [joint, max_rad] : {std::pair{kBoom, 2.9}, std::pair{kArm, 0.3}, std::pair{kBucket, 0.95}}) {
    MachineDescription machine = test::shipped("solar015");
    machine.links[static_cast<std::size_t>(joint)].max_rad = max_rad;
    const std::string line = geometry_refusal(machine);
    const std::string key = std::string("key 'links.") + kJointNames[static_cast<std::size_t>(joint)] + ".max_rad' = ";
    EXPECT_TRUE(test::says(line, key));
    EXPECT_TRUE(line.find("at least 5 mm") != std::string::npos || line.find("cannot close") != std::string::npos)
        << line;
  }
}

// Pins are nominal within millimetres, and so are the ends of the stroke.
TEST(Kinematics, GrantsACalibratedMachineAFewMillimetresOfStroke) {
  MachineDescription machine = test::shipped("solar015");
  const double needed = Kinematics(machine).cylinder_at(kBucket, machine.links[kBucket].min_rad)->length_m;
  machine.cylinders[kBucket].max_length_m = needed - 0.003;
  EXPECT_TRUE(test::says(geometry_refusal(machine), "cylinders.bucket.max_length_m"));
  machine.geometry_calibration.emplace();
  EXPECT_EQ(geometry_refusal(machine), "accepted");
  machine.cylinders[kBucket].max_length_m = needed - 0.006;
  EXPECT_TRUE(test::says(geometry_refusal(machine), "cylinders.bucket.max_length_m"));
}

}  // namespace
}  // namespace knuckle
