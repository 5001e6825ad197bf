// The parameters that are identified are those that motion can tell apart, on every machine that is shipped.
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <filesystem>
#include <random>

#include "estimation/regressor.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::estimation {
namespace {

TEST(BaseParameters, AllShowInMotionAndNoneIsACombinationOfOthersOnTheShippedMachines) {
  int machines = 0;
  for (const auto& file : std::filesystem::directory_iterator(test::source_dir() + "/config/machines")) {
    if (file.path().extension() != ".toml") continue;
    SCOPED_TRACE(file.path());
    const MachineDescription machine = load_machine(file.path());
    const RigidArm arm(machine);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0, 1);
    constexpr int kPoses = 200;
    Eigen::MatrixXd columns(kJoints * kPoses, kBaseParameters);
    for (int pose = 0; pose < kPoses; ++pose) {
      JointVector joint_rad;
      for (int j = 0; j < kJoints; ++j) {
        const LinkDescription& link = machine.links[static_cast<std::size_t>(j)];
        joint_rad[j] = link.min_rad + share(random) * (link.max_rad - link.min_rad);
      }
      const auto within = [&] { return 2 * share(random) - 1; };
      const JointVector rate(within(), within(), within()), acceleration(within(), within(), within());
      columns.middleRows<kJoints>(kJoints * pose) = arm.inverse_dynamics(Pose(joint_rad, 0), rate, acceleration);
    }
    columns.colwise().normalize();
    const Eigen::VectorXd values = columns.jacobiSvd().singularValues();
    EXPECT_GT(values[kBaseParameters - 1], 0.01 * values[0]) << values.transpose();
    ++machines;
  }
  EXPECT_GE(machines, 2);
}

}  // namespace
}  // namespace knuckle::estimation
