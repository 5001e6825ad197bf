// The calibration's own kinematics is the controller's.
#include "estimation/identification/survey_geometry.h"

#include <gtest/gtest.h>

#include <random>

#include "machine/load.h"

namespace knuckle::estimation {
namespace {

TEST(SurveyGeometry, PointsAreThoseOfTheKinematicsForAnyReading) {
  for (const char* name : {"solar015", "compact080"}) {
    MachineDescription machine = load_machine(find_config("machine", name));
    machine.sensors.encoder_offset_m = JointVector(3e-4, -2e-4, 1e-4);
    const Kinematics kinematics(machine);
    const GeometryVector geometry = geometry_of(machine);
    const LinkageSides sides = sides_of(machine);
    std::mt19937 random(1);
    for (int n = 0; n < 200; ++n) {
      JointVector pose, reading;
      for (int i = 0; i < kJoints; ++i) {
        const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
        pose[i] = std::uniform_real_distribution<double>(link.min_rad, link.max_rad)(random);
        reading[i] = kinematics.cylinder_at(i, pose[i])->length_m + machine.sensors.encoder_offset_m[i];
      }
      std::array<PlanarVector, kJoints> points;
      ASSERT_TRUE(survey_points(geometry.data(), reading, sides, points));
      EXPECT_LT((points[kBucket] - kinematics.tip(pose)).norm(), 1e-9) << name << " at " << pose.transpose();
      EXPECT_NEAR((points[kArm] - points[kBoom]).norm(), machine.links[kArm].length_m, 1e-12);
    }
  }
}

TEST(SurveyGeometry, VectorAndDescriptionHoldTheSameNumbers) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  GeometryVector geometry = geometry_of(machine);
  for (int i = 0; i < kGeometryCount; ++i) geometry[i] += 1e-4 * (i + 1);
  EXPECT_EQ(geometry_of(with_geometry(machine, geometry)), geometry);
}

TEST(SurveyGeometry, SaysWhereALinkageCannotClose) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const GeometryVector geometry = geometry_of(machine);
  std::array<PlanarVector, kJoints> points;
  EXPECT_FALSE(survey_points(geometry.data(), JointVector(3, 1.1, 0.9), sides_of(machine), points));
}

}  // namespace
}  // namespace knuckle::estimation
