// The papers' methods on data that are exactly their model; what they refuse; the tables' names and units.
#include <gtest/gtest.h>

#include <array>

#include "estimation/identification/baseline.h"
#include "estimation/identification/paper_motions.h"
#include "estimation/identification/static_poses.h"
#include "tests/estimation/test_machine.h"
#include "tests/identification/synthetic_recording.h"

namespace knuckle::estimation {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

JointVector gravity_torque(const MachineDescription& machine, const JointVector& angle) {
  return inverse_dynamics(RigidArm(machine), base_parameters(machine), angle, JointVector::Zero(), JointVector::Zero(),
                          0);
}

const JointVector kJointFriction_Nms = JointVector(37.19, 15.60, 3.57) / kDegree;  // table 1 of K

Recording kim_recording(const MachineDescription& machine, double duration_s, const JointVector& external_Nm) {
  return exact_recording(machine, duration_s, 0.005, waving(0.5), [&](const ExactMotion& m) -> JointVector {
    return gravity_torque(machine, m.angle) + kJointFriction_Nms.cwiseProduct(m.rate) - external_Nm;
  });
}

/// Stands still for half a minute.
Recording standing(const MachineDescription& machine) {
  return exact_recording(
      machine, 30, 0.01,
      [](double) {
        return ExactMotion{{0.3, -1.5, -0.9}, JointVector::Zero(), JointVector::Zero()};
      },
      [&](const ExactMotion& m) { return gravity_torque(machine, m.angle); });
}

double value_of(const Identification& summary, const std::string& name) {
  for (const IdentifiedParameter& p : summary.parameters) {
    if (p.name == name) return p.value;
  }
  ADD_FAILURE() << "no parameter " << name;
  return 0;
}

bool says(const Identification& summary, const std::string& what) {
  for (const std::string& reason : summary.reasons) {
    if (reason.find(what) != std::string::npos) return true;
  }
  return false;
}

/// Of a minute of free motion.
const KimResult& kim_result() {
  static const KimResult result =
      identify_kim(test_machine(), std::array{kim_recording(test_machine(), 60, JointVector::Zero())});
  return result;
}

TEST(Kim, RecoversTableOneOfThePaperInItsUnits) {
  const KimResult& result = kim_result();
  EXPECT_TRUE(result.summary.usable);
  EXPECT_EQ(result.summary.rank, 9);
  const std::vector<std::tuple<std::string, std::string, double>> table{
      {"m1 L_O1G1", "kg m", 98.65}, {"A_mc1", "deg", 11.48}, {"mu1", "N m/(deg/s)", 37.19},
      {"m2 L_O2G2", "kg m", 28.30}, {"A_mc2", "deg", -2.67}, {"mu2", "N m/(deg/s)", 15.60},
      {"m3 L_O3G3", "kg m", 26.01}, {"A_mc3", "deg", 31.82}, {"mu3", "N m/(deg/s)", 3.57}};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const auto& [name, unit, value] = table[i];
    EXPECT_EQ(result.summary.parameters[i].name, name);
    EXPECT_EQ(result.summary.parameters[i].unit, unit);
    EXPECT_NEAR(result.summary.parameters[i].value, value, 0.005 * std::abs(value)) << name;
    EXPECT_FALSE(result.summary.parameters[i].fixed);
  }
  EXPECT_TRUE(result.summary.parameters[9].fixed);
  EXPECT_TRUE(result.summary.parameters[10].fixed);
  EXPECT_DOUBLE_EQ(value_of(result.summary, "m3"), 60);
}

TEST(Kim, FindsAKnownForceAndWrench) {
  const MachineDescription machine = test_machine();
  const KimResult& result = kim_result();
  const Kinematics kinematics(machine);
  const PlanarVector pull(300, -800);
  const Recording pulled = exact_recording(machine, 10, 0.005, waving(0.5), [&](const ExactMotion& m) -> JointVector {
    return gravity_torque(machine, m.angle) + kJointFriction_Nms.cwiseProduct(m.rate) -
           kinematics.tip_jacobian(m.angle).transpose() * pull;
  });
  const auto force = external_force(result, machine, pulled);
  const auto wrench = external_wrench(result, machine, pulled);
  ASSERT_EQ(force.size(), pulled.samples.size());
  for (std::size_t i = 100; i + 100 < force.size(); i += 50) {
    EXPECT_LT((force[i] - pull).norm(), 8) << i;
    EXPECT_LT((wrench[i].head<2>() - pull).norm(), 16) << i;
    EXPECT_NEAR(wrench[i][2], 0, 8) << i;
  }
  EXPECT_TRUE(force.front().array().isNaN().all());  // no rate at the edge
}

TEST(Kim, RefusesTheStraightArm) {
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian.setRandom();
  EXPECT_TRUE(wrench_of_three_joints(jacobian, {0.3, -0.1, -1}, JointVector::Ones()).array().isNaN().all());
  EXPECT_TRUE(wrench_of_three_joints(jacobian, {0.3, -1.1, -1}, JointVector::Ones()).allFinite());
}

TEST(Kim, RefusesShortConstantAndDeadData) {
  const MachineDescription machine = test_machine();
  const Recording brief = kim_recording(machine, 3, JointVector::Zero());
  const KimResult short_result = identify_kim(machine, std::span(&brief, 1));
  EXPECT_FALSE(short_result.summary.usable);
  EXPECT_TRUE(says(short_result.summary, "at least 20 s")) << short_result.summary.reasons.front();

  const Recording still = standing(machine);
  const KimResult still_result = identify_kim(machine, std::span(&still, 1));
  EXPECT_FALSE(still_result.summary.usable);
  EXPECT_TRUE(says(still_result.summary, "boom moved over 0 deg"));

  Recording dead = kim_recording(machine, 30, JointVector::Zero());
  for (Measurement& m : dead.samples) m.pressure_Pa.fill(0);
  const KimResult dead_result = identify_kim(machine, std::span(&dead, 1));
  EXPECT_FALSE(dead_result.summary.usable);
  EXPECT_TRUE(says(dead_result.summary, "arm pressures never change"));
  EXPECT_TRUE(external_force(dead_result, machine, dead)[500].array().isNaN().all());
}

Recording poses_recording(const MachineDescription& machine, const std::vector<JointVector>& poses) {
  constexpr double kMove_s = 0.6, kRest_s = 0.8;
  return exact_recording(machine, (kMove_s + kRest_s) * static_cast<double>(poses.size()), 0.02,
                         stop_and_go(poses, kMove_s, kRest_s),
                         [&](const ExactMotion& m) { return gravity_torque(machine, m.angle); });
}

TEST(StaticPoses, RecoverTheGravityParametersOfStickAndBucket) {
  const MachineDescription machine = test_machine();
  const BaseParameters truth = base_parameters(machine);
  const Recording recording = poses_recording(machine, static_poses(machine, 160, 5));
  const StaticResult result = identify_static(machine, std::span(&recording, 1));
  EXPECT_TRUE(result.summary.usable) << result.summary.reasons.front();
  EXPECT_GE(result.poses, 155);
  ASSERT_EQ(result.summary.parameters.size(), 4U);
  EXPECT_EQ(result.summary.parameters[0].unit, "kg m");
  EXPECT_NEAR(value_of(result.summary, "S1"), truth[kMomentX + kBucket], 0.02);
  EXPECT_NEAR(value_of(result.summary, "S2"), truth[kMomentZ + kBucket], 0.02);
  EXPECT_NEAR(value_of(result.summary, "S3"), truth[kMomentX + kArm], 0.02);
  EXPECT_NEAR(value_of(result.summary, "S4"), truth[kMomentZ + kArm], 0.02);
}

TEST(StaticPoses, TakeTheBoomTooWhereAsked) {
  const MachineDescription machine = test_machine();
  const BaseParameters truth = base_parameters(machine);
  const Recording recording = poses_recording(machine, static_poses(machine, 160, 6));
  StaticOptions options;
  options.first_link = kBoom;
  const StaticResult result = identify_static(machine, std::span(&recording, 1), options);
  EXPECT_EQ(result.summary.rank, 6);
  EXPECT_NEAR(value_of(result.summary, "S5"), truth[kMomentX + kBoom], 0.05);
  EXPECT_NEAR(value_of(result.summary, "S6"), truth[kMomentZ + kBoom], 0.05);
}

TEST(StaticPoses, LeaveOutPosesNearEndStops) {
  const MachineDescription machine = test_machine();
  const Kinematics kinematics(machine);
  std::vector<JointVector> poses = static_poses(machine, 20, 7);
  const double near_end = *kinematics.joint_at(kArm, machine.cylinders[kArm].max_length_m - 0.018);
  for (std::size_t i = 0; i < poses.size(); i += 4) poses[i][kArm] = near_end;
  const Recording recording = poses_recording(machine, poses);
  StaticOptions options;
  options.stop_margin_m = 0.019;
  const StaticResult result = identify_static(machine, std::span(&recording, 1), options);
  EXPECT_EQ(result.near_stops, 5);
  EXPECT_EQ(result.poses, 15);
  EXPECT_FALSE(result.summary.usable);
  EXPECT_TRUE(says(result.summary, "15 poses at rest; at least 150"));
}

TEST(StaticPoses, RefuseIdenticalPoses) {
  const MachineDescription machine = test_machine();
  const JointVector pose(0.3, -1.5, -0.9);
  const Recording one = poses_recording(machine, std::vector<JointVector>(10, pose));
  const StaticResult standing = identify_static(machine, std::span(&one, 1));
  EXPECT_FALSE(standing.summary.usable);
  EXPECT_TRUE(says(standing.summary, "1 poses at rest"));
  // The same again, but apart: the same rest in ten recordings.
  const std::vector<Recording> ten(10, one);
  StaticOptions options;
  options.least_poses = 10;
  const StaticResult result = identify_static(machine, ten, options);
  EXPECT_FALSE(result.summary.usable);
  EXPECT_EQ(result.poses, 10);
}

const MalagutiVector kCylinderFriction =
    (MalagutiVector() << 0, 0, 0, 0, 0, 0, 52.23, 31444.87, 35.67, 30167).finished();  // table 2 of M

Recording malaguti_recording(const MachineDescription& machine, double duration_s, const PlanarVector& pull_N) {
  const Kinematics kinematics(machine);
  return exact_recording(machine, duration_s, 0.005, waving(), [&, pull_N](const ExactMotion& m) -> JointVector {
    JointVector torque =
        inverse_dynamics(RigidArm(machine), base_parameters(machine), m.angle, m.rate, m.acceleration, 0) -
        kinematics.tip_jacobian(m.angle).transpose() * pull_N;
    for (const auto& [joint, at] : {std::pair{kBucket, 6}, std::pair{kArm, 8}}) {
      const double lever = kinematics.cylinder_at(joint, m.angle[joint])->lever_m, v = lever * m.rate[joint];
      torque[joint] += lever * (kCylinderFriction[at] * (v > 0 ? 1 : -1) + kCylinderFriction[at + 1] * v);
    }
    return torque;
  });
}

/// Free motion of 40 s, and what is found from it.
const Recording& malaguti_free() {
  static const Recording recording = malaguti_recording(test_machine(), 40, PlanarVector::Zero());
  return recording;
}
const MalagutiResult& malaguti_result() {
  static const MalagutiResult result = identify_malaguti(test_machine(), std::span(&malaguti_free(), 1));
  return result;
}

TEST(Malaguti, RecoversInertiasMomentsAndFrictionWhileTheBoomMoves) {
  const BaseParameters truth = base_parameters(test_machine());
  const MalagutiResult& result = malaguti_result();
  EXPECT_TRUE(result.summary.usable);
  EXPECT_EQ(result.summary.rank, 10);
  const std::vector<std::tuple<std::string, std::string, double>> table{
      {"phi_D1", "kg m^2", truth[kInertia + kBucket]}, {"phi_D2", "kg m^2", truth[kInertia + kArm]},
      {"phi_S1", "kg m", truth[kMomentX + kBucket]},   {"phi_S2", "kg m", truth[kMomentZ + kBucket]},
      {"phi_S3", "kg m", truth[kMomentX + kArm]},      {"phi_S4", "kg m", truth[kMomentZ + kArm]},
      {"phi_f1", "kg m/s^2", kCylinderFriction[6]},    {"phi_f2", "kg/s", kCylinderFriction[7]},
      {"phi_f3", "kg m/s^2", kCylinderFriction[8]},    {"phi_f4", "kg/s", kCylinderFriction[9]}};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const auto& [name, unit, value] = table[i];
    EXPECT_EQ(result.summary.parameters[i].name, name);
    EXPECT_EQ(result.summary.parameters[i].unit, unit);
    EXPECT_NEAR(result.summary.parameters[i].value, value, 0.02 * std::abs(value) + 0.02) << name;
  }
}

TEST(Malaguti, FindsAKnownForceButNotAlongAStraightBucket) {
  const MachineDescription machine = test_machine();
  const MalagutiResult& result = malaguti_result();
  const PlanarVector pull(-500, 700);
  const Recording pulled = malaguti_recording(machine, 20, pull);
  const auto force = external_force(result, machine, pulled);
  const MotionLaw law = waving();
  int known = 0;
  for (std::size_t i = 100; i + 100 < force.size(); i += 20) {
    const double bucket_rad = law(static_cast<double>(i) * 0.005).angle[kBucket];
    EXPECT_EQ(force[i].hasNaN(), std::abs(std::sin(bucket_rad)) < kStraightSine) << i;
    if (force[i].hasNaN()) continue;
    EXPECT_LT((force[i] - pull).norm(), 80) << i;
    ++known;
  }
  EXPECT_GT(known, 100);
}

TEST(Malaguti, ComparesTorqueOfStickAndBucketOnly) {
  const TorqueComparison torque = compare_torque(malaguti_result(), test_machine(), malaguti_free());
  EXPECT_DOUBLE_EQ(torque.step_s, 0.005);
  ASSERT_EQ(torque.usable.size(), malaguti_free().samples.size());
  EXPECT_EQ(torque.usable.front(), 0);
  EXPECT_EQ(torque.usable[4000], 1);
  EXPECT_TRUE(std::isnan(torque.modelled_Nm[4000][kBoom]));
  for (const int joint : {kArm, kBucket})
    EXPECT_NEAR(torque.modelled_Nm[4000][joint], torque.measured_Nm[4000][joint], 10);
}

TEST(Malaguti, RefusesThreeSecondsAndAStandingStick) {
  const MachineDescription machine = test_machine();
  const Recording brief = malaguti_recording(machine, 3, PlanarVector::Zero());
  EXPECT_TRUE(says(identify_malaguti(machine, std::span(&brief, 1)).summary, "at least 20 s"));
  const Recording still = standing(machine);
  const MalagutiResult result = identify_malaguti(machine, std::span(&still, 1));
  EXPECT_FALSE(result.summary.usable);
  EXPECT_TRUE(says(result.summary, "arm moved over 0 deg"));
}

/// Largest rod flow of a path as a share of the pump's; fails where it leaves the joints' ranges.
double checked_flow_share(const MachineDescription& machine, const JointPath& path) {
  const Kinematics kinematics(machine);
  double worst = 0;
  for (std::size_t i = 1; i < path.joint_rad.size(); ++i) {
    double flow = 0;
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto k = static_cast<std::size_t>(joint);
      const double now = path.joint_rad[i][joint], before = path.joint_rad[i - 1][joint];
      EXPECT_GT(now, machine.links[k].min_rad + machine.limits.joint_soft_margin_rad);
      EXPECT_LT(now, machine.links[k].max_rad - machine.limits.joint_soft_margin_rad);
      const double speed =
          std::abs(kinematics.cylinder_at(joint, now)->length_m - kinematics.cylinder_at(joint, before)->length_m) /
          path.step_s;
      flow += speed * machine.cylinders[k].head_area_m2();
    }
    worst = std::max(worst, flow / machine.hydraulics.pump_flow_m3ps);
  }
  return worst;
}

TEST(PaperMotions, StayInRangeAndWithinThePump) {
  MachineDescription machine = test_machine();
  machine.hydraulics.pump_flow_m3ps = 32e-3 / 60;
  machine.limits.joint_soft_margin_rad = 0.05;
  for (const JointPath& path : {kim_slow_motion(machine), kim_verification_1(machine), kim_verification_2(machine)}) {
    const double share = checked_flow_share(machine, path);
    EXPECT_LE(share, 0.8);
    EXPECT_GT(share, 0.1);
    EXPECT_LT(path.duration_s(), 120);
  }
  const JointPath digging = malaguti_dig_like_motion(machine, 1);
  EXPECT_NEAR(digging.duration_s(), 40, 0.01);
  EXPECT_LE(checked_flow_share(machine, digging), 0.8);
  EXPECT_GT(checked_flow_share(machine, digging), 0.5);
  EXPECT_NE(digging.joint_rad[2000], malaguti_dig_like_motion(machine, 2).joint_rad[2000]);
  EXPECT_EQ(digging.joint_rad[2000], malaguti_dig_like_motion(machine, 1).joint_rad[2000]);
}

}  // namespace
}  // namespace knuckle::estimation
