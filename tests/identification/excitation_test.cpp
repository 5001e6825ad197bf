// Designed motions stay within what the machine may do, repeat, and tell the parameters of the torque model apart.
#include "estimation/identification/excitation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "estimation/identification/path_check.h"
#include "machine/load.h"

namespace knuckle::estimation {
namespace {

MachineDescription machine(const char* name) {
  return load_machine(find_config("machine", name));
}

std::string text(const std::vector<std::string>& lines) {
  std::string all;
  for (const auto& line : lines) all += line + "; ";
  return all;
}

TEST(Excitation, StaysWithinTheMachinesLimits) {
  for (const char* name : {"solar015", "compact080"}) {
    const MachineDescription m = machine(name);
    EXPECT_EQ(text(check_path(m, slow_sweeps(m, 60))), "") << name;
    EXPECT_EQ(text(check_path(m, fast_excitation(m, 40))), "") << name;
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      EXPECT_EQ(text(check_path(m, held_out_motion(m, seed, MotionSpeed::kSlow))), "") << name;
      EXPECT_EQ(text(check_path(m, held_out_motion(m, seed, MotionSpeed::kDigging))), "") << name;
    }
  }
}

TEST(Excitation, KeepsClearOfWalls) {
  MachineDescription m = machine("solar015");
  m.limits.floor_m = -1.0;
  m.limits.reach_m = 2.6;
  EXPECT_EQ(text(check_path(m, slow_sweeps(m, 60))), "");
  EXPECT_EQ(text(check_path(m, held_out_motion(m, 1, MotionSpeed::kDigging))), "");
  m.limits.floor_m = 3;
  EXPECT_THROW((void)held_out_motion(m, 1, MotionSpeed::kDigging), InputError);
}

TEST(Excitation, SweepsAtTwoToFourCentimetresPerSecondBothWays) {
  const MachineDescription m = machine("solar015");
  const Kinematics kinematics(m);
  const JointPath path = slow_sweeps(m);
  EXPECT_NEAR(path.duration_s(), 120, 0.01);
  for (int joint = 0; joint < kJoints; ++joint) {
    int extending = 0, retracting = 0;
    double low = 1e9, high = -1e9, fastest = 0;
    for (std::size_t i = 1; i < path.joint_rad.size(); ++i) {
      const double length = kinematics.cylinder_at(joint, path.joint_rad[i][joint])->length_m;
      const double speed = (length - kinematics.cylinder_at(joint, path.joint_rad[i - 1][joint])->length_m) / 0.005;
      extending += speed > 0.0195 ? 1 : 0;
      retracting += speed < -0.0195 ? 1 : 0;
      fastest = std::max(fastest, std::abs(speed));
      low = std::min(low, length);
      high = std::max(high, length);
    }
    const CylinderDescription& cylinder = m.cylinders[static_cast<std::size_t>(joint)];
    EXPECT_LE(fastest, 0.0405);
    EXPECT_GT(extending * 0.005, 20) << kJointNames[static_cast<std::size_t>(joint)];
    EXPECT_GT(retracting * 0.005, 20) << kJointNames[static_cast<std::size_t>(joint)];
    EXPECT_GT(high - low, 0.7 * (cylinder.max_length_m - cylinder.min_length_m));
  }
}

TEST(Excitation, SearchedSeriesIsBetterConditionedThanOneJointsMotion) {
  const MachineDescription m = machine("solar015");
  const PathCondition condition(m, true);
  const JointPath fast = fast_excitation(m);
  EXPECT_NEAR(fast.duration_s(), 80, 0.01);
  EXPECT_LT(condition(fast, 20), 16);
  const PathExtremes extremes = path_extremes(m, fast);
  EXPECT_GT(extremes.fastest_cylinder_mps.maxCoeff(), 0.09);
  JointPath boom_alone = fast;
  for (auto& angle : boom_alone.joint_rad) angle.tail<2>() = fast.joint_rad.front().tail<2>();
  EXPECT_TRUE(std::isinf(condition(boom_alone, 20)));
}

TEST(Excitation, RepeatsWithItsSeedAndDiffersWithAnother) {
  const MachineDescription m = machine("solar015");
  const auto middle = [](const JointPath& path) { return path.joint_rad[path.joint_rad.size() / 2]; };
  EXPECT_EQ(middle(slow_sweeps(m, 30)), middle(slow_sweeps(m, 30)));
  EXPECT_NE(middle(held_out_motion(m, 1, MotionSpeed::kDigging)), middle(held_out_motion(m, 2, MotionSpeed::kDigging)));
}

TEST(PathCheck, SaysWhatIsViolated) {
  const MachineDescription m = machine("solar015");
  const JointPath good = held_out_motion(m, 1, MotionSpeed::kDigging);
  const auto says = [&](const JointPath& path, const char* word) {
    return text(check_path(m, path)).find(word) != std::string::npos;
  };
  JointPath fast = good;
  fast.step_s /= 2;
  EXPECT_TRUE(says(fast, "pump flow") && says(fast, "rate")) << text(check_path(m, fast));
  JointPath jump = good;
  jump.joint_rad[3000][kArm] += 0.01;
  EXPECT_TRUE(says(jump, "jump at 1"));
  JointPath broken = good;
  broken.joint_rad[100][kBoom] = std::nan("");
  EXPECT_TRUE(says(broken, "not a number at 0.5 s"));
  JointPath high = good;
  for (auto& angle : high.joint_rad) angle[kBoom] += 0.3;
  EXPECT_TRUE(says(high, "boom: highest angle"));
  JointPath cut = good;
  cut.joint_rad.resize(400);
  EXPECT_TRUE(says(cut, "end: not at rest")) << text(check_path(m, cut));
  EXPECT_TRUE(says({0.005, {}}, "too short"));
  MachineDescription floor = m;
  floor.limits.floor_m = -1;
  EXPECT_NE(text(check_path(floor, good)).find("floor"), std::string::npos);
}

}  // namespace
}  // namespace knuckle::estimation
