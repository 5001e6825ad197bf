// What Foxglove is told of the machine in 3-D, read back by the messages' own schemas.
#include "recording/scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <string>

#include "machine/kinematics.h"
#include "machine/load.h"
#include "recording/topics.h"
#include "tests/recording/ros2_message.h"
#include "tests/support/no_alloc.h"
#include "tests/support/places.h"

namespace knuckle::recording {
namespace {

using test::Ros2Message;
using test::Ros2Schema;

constexpr std::int64_t kUnix_ns = 1'700'000'000'900'000'000;
constexpr int kPostures = 100;

const Ros2Schema kTransforms(foxglove_schema(kTransformsSchemaName));
const Ros2Schema kScene(foxglove_schema(kSceneSchemaName));

Eigen::Vector3d vector_at(const Ros2Message& message, const std::string& path) {
  return {message.number(path + ".x"), message.number(path + ".y"), message.number(path + ".z")};
}
Eigen::Quaterniond turn_at(const Ros2Message& message, const std::string& path) {
  return {message.number(path + ".w"), message.number(path + ".x"), message.number(path + ".y"),
          message.number(path + ".z")};
}
PlanarVector in_plane(const Eigen::Vector3d& at) {
  return {at.x(), at.z()};
}

/// Where each frame is in "machine".
std::map<std::string, Eigen::Isometry3d> frames_of(const Ros2Message& message) {
  std::map<std::string, Eigen::Isometry3d> frames{{"machine", Eigen::Isometry3d::Identity()}};
  for (int i = 0; i < message.size("transforms"); ++i) {
    const std::string path = "transforms[" + std::to_string(i) + "].";
    const Eigen::Quaterniond turn = turn_at(message, path + "rotation");
    EXPECT_NEAR(turn.norm(), 1, 1e-12);
    frames[message.text(path + "child_frame_id")] = frames.at(message.text(path + "parent_frame_id")) *
                                                    Eigen::Translation3d(vector_at(message, path + "translation")) *
                                                    turn;
  }
  return frames;
}

/// Paths of a message's entities by their ids.
std::map<std::string, std::string> entities_of(const Ros2Message& message) {
  std::map<std::string, std::string> paths;
  for (int i = 0; i < message.size("entities"); ++i) {
    const std::string path = "entities[" + std::to_string(i) + "].";
    EXPECT_TRUE(paths.emplace(message.text(path + "id"), path).second) << message.text(path + "id") << " twice";
  }
  return paths;
}

std::set<std::string> deletions_of(const Ros2Message& message) {
  std::set<std::string> ids;
  for (int i = 0; i < message.size("deletions"); ++i) {
    const std::string path = "deletions[" + std::to_string(i) + "].";
    EXPECT_EQ(message.number(path + "type"), 0) << "must delete what has its id";
    ids.insert(message.text(path + "id"));
  }
  return ids;
}

class SceneWriterOf : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] Ros2Message transforms(const slave::SlaveState& state) {
    return {kTransforms, writer_.transforms(state, kUnix_ns)};
  }
  [[nodiscard]] Ros2Message scene(const slave::SlaveState& state) { return {kScene, writer_.scene(state, kUnix_ns)}; }

  /// Anything within the working range, and any force.
  [[nodiscard]] slave::SlaveState drawn() {
    const auto between = [this](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random_);
    };
    slave::SlaveState state;
    state.at = Time(from_seconds(between(0, 1000)));
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine_.links[static_cast<std::size_t>(i)];
      state.joint_rad[i] = between(link.min_rad, link.max_rad);
    }
    state.tip_force_N = {between(-9000, 9000), between(-9000, 9000)};
    const double across = between(-0.9, 0.9), xx = between(1, 1e4), zz = between(1, 1e4);
    state.covariance_N2 = {xx, across * std::sqrt(xx * zz), zz};
    state.confidence = between(0, 1);
    state.contact = between(0, 1) > 0.5;
    state.payload_sigma_kg = between(0, 20);
    state.payload_kg = between(-10, 100);
    return state;
  }

  const MachineDescription machine_ =
      calibrated(load_machine(test::source_dir() + "/config/machines/" + GetParam() + ".toml"));
  const Kinematics kinematics_{machine_};
  SceneWriter writer_{machine_};
  std::mt19937 random_{20261125};
};

INSTANTIATE_TEST_SUITE_P(Machines, SceneWriterOf, ::testing::Values("solar015", "compact080", "standard200"));

TEST_P(SceneWriterOf, FramesLeadToWhereKinematicsHasTheTip) {
  for (int i = 0; i < kPostures; ++i) {
    const slave::SlaveState state = drawn();
    const auto frames = frames_of(transforms(state));
    ASSERT_EQ(frames.size(), 6u);
    const Eigen::Vector3d tip = frames.at("tip").translation();
    EXPECT_NEAR((in_plane(tip) - kinematics_.tip(state.joint_rad)).norm(), 0, 1e-12);
    EXPECT_NEAR(tip.y(), 0, 1e-12);
    const Eigen::Vector3d along = frames.at("tip").linear().col(0);
    EXPECT_NEAR(std::remainder(std::atan2(along.z(), along.x()) - state.joint_rad.sum(), 2 * M_PI), 0, 1e-12);
  }
}

TEST_P(SceneWriterOf, LinksHaveTheirFramesAtTheirJoints) {
  const slave::SlaveState state = drawn();
  const MachinePose pose = pose_of(machine_, state.joint_rad);
  const auto frames = frames_of(transforms(state));
  for (const auto& [name, frame] : {std::pair{"boom", pose.boom}, {"arm", pose.arm}, {"bucket", pose.bucket}})
    EXPECT_NEAR((in_plane(frames.at(name) * Eigen::Vector3d(0.3, 0, 0.2)) - frame * PlanarVector(0.3, 0.2)).norm(), 0,
                1e-12)
        << name;
  EXPECT_TRUE(frames.at("ground").isApprox(Eigen::Isometry3d(Eigen::Translation3d(0, 0, ground_level_m(machine_)))));
}

TEST_P(SceneWriterOf, StampsAreTheTimeOfTheStep) {
  slave::SlaveState state = drawn();
  state.at = Time(1234ms);
  EXPECT_NEAR(transforms(state).seconds("transforms[4].timestamp"), 1'700'000'002.134, 1e-6);
  state.contact = false;
  const Ros2Message message = scene(state);
  EXPECT_NEAR(message.seconds("entities[1].timestamp"), 1'700'000'002.134, 1e-6);
  EXPECT_NEAR(message.seconds("deletions[0].timestamp"), 1'700'000'002.134, 1e-6);
}

/// "1 m = 2000 N" in the note.
double newtons_per_m(const Ros2Message& message, const std::string& entity) {
  EXPECT_EQ(message.size(entity + "metadata"), 1);
  EXPECT_EQ(message.text(entity + "metadata[0].key"), "scale");
  const std::string& note = message.text(entity + "metadata[0].value");
  EXPECT_TRUE(note.starts_with("1 m = ") && note.ends_with(" N")) << note;
  return std::stod(note.substr(6));
}

TEST_P(SceneWriterOf, ForceIsAnArrowFromTheTipToTheScaleThatItsNoteSays) {
  for (int i = 0; i < kPostures; ++i) {
    const slave::SlaveState state = drawn();
    const Ros2Message message = scene(state);
    const std::string force = entities_of(message).at("force"), arrow = force + "arrows[0].";
    EXPECT_EQ(message.text(force + "frame_id"), "machine");
    ASSERT_EQ(message.size(force + "arrows"), 1);
    const Eigen::Vector3d tail = vector_at(message, arrow + "pose.position");
    EXPECT_NEAR((in_plane(tail) - kinematics_.tip(state.joint_rad)).norm(), 0, 1e-12);
    const double length = message.number(arrow + "shaft_length") + message.number(arrow + "head_length");
    const Eigen::Vector3d shown = newtons_per_m(message, force) * length *
                                  (turn_at(message, arrow + "pose.orientation") * Eigen::Vector3d::UnitX());
    EXPECT_NEAR((in_plane(shown) - state.tip_force_N).norm(), 0, 1e-9 * state.tip_force_N.norm());
    EXPECT_NEAR(shown.y(), 0, 1e-9);
    EXPECT_GE(message.number(arrow + "shaft_length"), 0);
  }
}

TEST_P(SceneWriterOf, NoForceIsAnArrowOfNoLength) {
  slave::SlaveState state = drawn();
  state.tip_force_N.setZero();
  const Ros2Message message = scene(state);
  const std::string arrow = entities_of(message).at("force") + "arrows[0].";
  EXPECT_EQ(message.number(arrow + "shaft_length") + message.number(arrow + "head_length"), 0);
  EXPECT_NEAR(turn_at(message, arrow + "pose.orientation").norm(), 1, 1e-12);
}

/// The ellipsoid's section, taken from the message as a quadratic form, is that of 95 %: points on it have the squared
/// Mahalanobis distance that two normal variables exceed in 5 of 100 cases.
TEST_P(SceneWriterOf, EllipseAroundTheArrowsEndIsThatOf95Percent) {
  for (int i = 0; i < kPostures; ++i) {
    slave::SlaveState state = drawn();
    state.confidence = 0.9;
    const Ros2Message message = scene(state);
    const std::string force = entities_of(message).at("force"), ellipse = force + "spheres[0].";
    ASSERT_EQ(message.size(force + "spheres"), 1);
    const double scale = newtons_per_m(message, force);
    const Eigen::Vector3d centre = vector_at(message, ellipse + "pose.position");
    const PlanarVector end = kinematics_.tip(state.joint_rad) + state.tip_force_N / scale;
    EXPECT_NEAR((in_plane(centre) - end).norm(), 0, 1e-9);
    Eigen::Matrix2d covariance;
    covariance << state.covariance_N2[0], state.covariance_N2[1], state.covariance_N2[1], state.covariance_N2[2];
    const Eigen::Quaterniond turn = turn_at(message, ellipse + "pose.orientation");
    for (double angle = 0; angle < 6; angle += 0.5) {
      const Eigen::Vector3d half = vector_at(message, ellipse + "size") / 2;
      const PlanarVector point =
          scale * in_plane(turn * Eigen::Vector3d(half.x() * std::cos(angle), 0, half.z() * std::sin(angle)));
      EXPECT_NEAR(point.dot(covariance.inverse() * point), 5.991465, 1e-4);
    }
  }
}

TEST_P(SceneWriterOf, ForceIsNamedOnlyWhereItIsKnownAndItsArrowFadesWithConfidence) {
  slave::SlaveState state = drawn();
  state.tip_force_N = {1200, -500};
  double opacity = 0;
  for (const auto& [confidence, label] : {std::pair{0.0, "force not known"},
                                          {0.3, "force not known"},
                                          {0.31, "1300 N (confidence 31 %)"},
                                          {0.85, "1300 N (confidence 85 %)"}}) {
    state.confidence = confidence;
    const Ros2Message message = scene(state);
    const std::string force = entities_of(message).at("force");
    EXPECT_EQ(message.text(force + "texts[0].text"), label);
    EXPECT_EQ(message.size(force + "spheres"), confidence > 0.3 ? 1 : 0);
    EXPECT_GT(message.number(force + "arrows[0].color.a"), opacity);
    opacity = message.number(force + "arrows[0].color.a");
  }
  EXPECT_LE(opacity, 1);
}

TEST_P(SceneWriterOf, ContactAndLoadAreThereWhereTheyAreSeenAndDeletedElse) {
  slave::SlaveState state = drawn();
  state.contact = true;
  state.payload_kg = 52.4;
  state.payload_sigma_kg = 4;
  const Ros2Message both = scene(state);
  const std::string ball = entities_of(both).at("contact") + "spheres[0].pose.position";
  EXPECT_NEAR((in_plane(vector_at(both, ball)) - kinematics_.tip(state.joint_rad)).norm(), 0, 1e-12);
  EXPECT_EQ(both.text(entities_of(both).at("load") + "texts[0].text"), "load 52 kg, sigma 4 kg");
  state.contact = false;
  state.payload_sigma_kg = 30;
  const Ros2Message none = scene(state);
  for (const char* id : {"contact", "load"}) {
    EXPECT_FALSE(deletions_of(both).contains(id)) << id;
    EXPECT_TRUE(deletions_of(none).contains(id)) << id;
    EXPECT_FALSE(entities_of(none).contains(id)) << id;
  }
}

TEST_P(SceneWriterOf, RodsReachFromPinToPin) {
  for (int i = 0; i < kPostures; ++i) {
    const slave::SlaveState state = drawn();
    const Ros2Message message = scene(state);
    const std::string cylinders = entities_of(message).at("cylinders");
    ASSERT_EQ(message.size(cylinders + "lines"), 2);
    EXPECT_EQ(message.number(cylinders + "lines[1].type"), 2) << "must be pairs of points";
    const auto point = [&](int line, int index) {
      return vector_at(message,
                       cylinders + "lines[" + std::to_string(line) + "].points[" + std::to_string(index) + "]");
    };
    for (int joint = 0; joint < kJoints; ++joint) {
      const Eigen::Vector3d rod = point(1, 2 * joint + 1) - point(1, 2 * joint);
      EXPECT_NEAR(rod.norm(), kinematics_.cylinder_at(joint, state.joint_rad[joint])->length_m, 1e-9);
      const Eigen::Vector3d barrel = point(0, 2 * joint + 1) - point(0, 2 * joint);
      EXPECT_LT(barrel.norm(), rod.norm());
      EXPECT_NEAR(barrel.normalized().dot(rod.normalized()), 1, 1e-12);
    }
    EXPECT_NEAR((point(1, 7) - point(1, 6)).norm(), machine_.bucket_linkage.rocker_length_m, 1e-9);
    EXPECT_NEAR((point(1, 9) - point(1, 8)).norm(), machine_.bucket_linkage.coupler_length_m, 1e-9);
  }
}

TEST_P(SceneWriterOf, MachineIsToldOnceASecondInFramesThatAreThere) {
  slave::SlaveState state = drawn();
  const auto frames = frames_of(transforms(state));
  int told = 0;
  for (int i = 0; i <= 75; ++i) {  // three seconds, 25 times in each
    state.at = Time(40ms * i);
    const auto bytes = writer_.machine(state, kUnix_ns);
    if (bytes.empty()) continue;
    ++told;
    const Ros2Message message(kScene, bytes);
    const auto entities = entities_of(message);
    for (const char* id : {"ground", "boom", "arm", "bucket"}) ASSERT_TRUE(entities.contains(id)) << id;
    for (const auto& [id, path] : entities) {
      EXPECT_TRUE(frames.contains(message.text(path + "frame_id"))) << id;
      EXPECT_EQ(message.number(path + "frame_locked"), 1) << id;
      EXPECT_EQ(message.seconds(path + "lifetime"), 0) << id;
    }
  }
  EXPECT_EQ(told, 4);
}

TEST_P(SceneWriterOf, LinksAndBucketHaveTheirLengthsAndOutline) {
  const Ros2Message message(kScene, writer_.machine(drawn(), kUnix_ns));
  for (const int joint : {kBoom, kArm}) {
    const auto k = static_cast<std::size_t>(joint);
    EXPECT_EQ(message.number(entities_of(message).at(kJointNames[k]) + "cubes[0].size.x"), machine_.links[k].length_m);
  }
  const std::string bucket = entities_of(message).at("bucket");
  const auto outline = bucket_outline(machine_);
  ASSERT_EQ(message.size(bucket + "lines"), 2) << "one on each side";
  for (const char* side : {"lines[0].points", "lines[1].points"}) {
    ASSERT_EQ(message.size(bucket + side), static_cast<int>(outline.size()));
    for (std::size_t i = 0; i < outline.size(); ++i)
      EXPECT_EQ(in_plane(vector_at(message, bucket + side + "[" + std::to_string(i) + "]")), outline[i]);
  }
}

TEST_P(SceneWriterOf, AllocatesNothing) {
  slave::SlaveState state = drawn();
  state.confidence = 0.9;
  state.contact = true;
  state.payload_kg = 90;
  std::size_t bytes = 0;
  test::NoAllocScope scope;
  for (int i = 0; i < 50; ++i) {
    state.at = Time(40ms * i);
    bytes += writer_.transforms(state, kUnix_ns).size() + writer_.scene(state, kUnix_ns).size() +
             writer_.machine(state, kUnix_ns).size();
  }
  EXPECT_EQ(scope.allocations(), 0u);
  EXPECT_GT(bytes, 0u);
}

}  // namespace
}  // namespace knuckle::recording
