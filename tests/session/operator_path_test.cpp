// Recorded motions as the operator's intent: nothing that was not recorded, nothing the machine cannot do, all told.
#include "app/session/operator_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "core/error.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "recording/file_names.h"
#include "tests/recording/recorded_session.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::session {
namespace {

namespace fs = std::filesystem;

constexpr double kPeriod_s = 5e-3;

struct RecordedPath {
  std::vector<double> time_s;
  std::vector<JointVector> joints_rad;
  void add(double t, double boom, double arm, double bucket) {
    time_s.push_back(t);
    joints_rad.emplace_back(boom, arm, bucket);
  }
};

std::string temporary(const std::string& suffix, const std::string& text) {
  const std::string test = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::string path = ::testing::TempDir() + "knuckle_path_" + test + suffix;
  std::ofstream(path) << text;
  return path;
}

OperatorPath play(const RecordedPath& recording) {
  std::string csv = "t,boom,arm,bucket,count\n";
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    std::array<char, 160> row;
    const JointVector& q = recording.joints_rad[i];
    std::snprintf(row.data(), row.size(), "%.6f,%.9f,%.9f,%.9f,%zu\n", recording.time_s[i], q[0], q[1], q[2], i);
    csv += row.data();
  }
  std::string map = "[time]\ncolumn = \"t\"\nunit = \"s\"\ngap_s = 0.5\n";
  for (const char* joint : {"boom", "arm", "bucket"}) {
    map += std::string("[[channel]]\nname = \"") + joint + "_rad\"\ncolumn = \"" + joint +
           "\"\nunit = \"rad\"\nsign = 1\noffset = 0\n";
  }
  return load_operator_path({temporary(".csv", csv)}, temporary(".toml", map), test::solar());
}

/// 30 rows at 0.1 s about the middle of the ranges; `reach` of the half range, so that small ones are slow.
RecordedPath random_recording(unsigned seed, double reach) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(-reach, reach), step(0.05, 0.15);
  RecordedPath recording;
  double t = 0;
  for (int row = 0; row < 30; ++row, t += step(random)) {
    JointVector q;
    for (std::size_t i = 0; i < kJoints; ++i) {
      const LinkDescription& link = test::solar().links[i];
      q[static_cast<Eigen::Index>(i)] =
          (link.min_rad + link.max_rad) / 2 + share(random) * (link.max_rad - link.min_rad) / 2;
    }
    recording.add(t, q[0], q[1], q[2]);
  }
  return recording;
}

bool told(const OperatorPath& path, const std::string& part) {
  return std::any_of(path.notes.begin(), path.notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

double highest(const std::vector<JointVector>& values, Eigen::Index joint) {
  double most = -1e9;
  for (const JointVector& v : values) most = std::max(most, v[joint]);
  return most;
}

std::vector<JointVector> joints_of(const OperatorPath& path) {
  std::vector<JointVector> joints;
  for (const sim::PathPoint& p : path.points) joints.push_back(p.joints_rad);
  return joints;
}

int turns(const std::vector<JointVector>& values, Eigen::Index joint) {
  int count = 0;
  double direction = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = values[i][joint] - values[i - 1][joint];
    if (std::abs(step) < 1e-12) continue;
    if (step * direction < 0) ++count;
    direction = step;
  }
  return count;
}

/// Every pair of points against the limits that time is stretched for, and against the ranges.
void expect_within_limits(const OperatorPath& path) {
  const Kinematics kinematics(test::solar());
  constexpr double kAllowed = kPathSpeedShare * 1.02;  // points are 5 ms apart, speeds change in between
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    const JointVector &a = path.points[i - 1].joints_rad, &b = path.points[i].joints_rad;
    double flow = 0;
    for (std::size_t j = 0; j < kJoints; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      const LinkDescription& link = test::solar().links[j];
      ASSERT_LE(std::abs(b[k] - a[k]), kAllowed * link.max_rate_radps * kPeriod_s) << kJointNames[j] << " at " << i;
      ASSERT_GE(b[k], link.min_rad + kPathRangeMargin_rad - 1e-9);
      ASSERT_LE(b[k], link.max_rad - kPathRangeMargin_rad + 1e-9);
      const int joint = static_cast<int>(j);
      const double extension =
          kinematics.cylinder_at(joint, b[k])->length_m - kinematics.cylinder_at(joint, a[k])->length_m;
      const CylinderDescription& cylinder = test::solar().cylinders[j];
      flow += extension > 0 ? extension * cylinder.head_area_m2() : -extension * cylinder.rod_side_area_m2();
    }
    ASSERT_LE(flow, kAllowed * test::solar().hydraulics.pump_flow_m3ps * kPeriod_s) << i;
    ASSERT_LE((kinematics.tip(b) - kinematics.tip(a)).norm(),
              kAllowed * test::solar().limits.tip_speed_mps * kPeriod_s);
  }
}

TEST(OperatorPath, NeverAsksForMoreThanItsShareOfJointTipAndPumpSpeedHoweverWildTheRecording) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const OperatorPath path = play(random_recording(seed, seed % 2 == 0 ? 0.9 : 2.0));
    expect_within_limits(path);
    EXPECT_GT(path.played_s, path.recorded_s);
    EXPECT_NEAR(path.played_s, kPeriod_s * static_cast<double>(path.points.size() - 1), 2 * kPeriod_s);
  }
}

TEST(OperatorPath, GoesThroughEveryRecordedExtremeAndNowhereBeyond) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const RecordedPath recording = random_recording(seed, 0.9);
    const std::vector<JointVector> played = joints_of(play(recording));
    for (Eigen::Index j = 0; j < kJoints; ++j) {
      EXPECT_LE(highest(played, j), highest(recording.joints_rad, j) + 1e-9);
      EXPECT_GE(highest(played, j), highest(recording.joints_rad, j) - 2e-3);
      EXPECT_EQ(turns(played, j), turns(recording.joints_rad, j)) << "no bump that was not recorded";
    }
  }
}

TEST(OperatorPath, StartsAndEndsAtRestWhereTheRecordingDoes) {
  const RecordedPath recording = random_recording(7, 0.9);
  const OperatorPath path = play(recording);
  EXPECT_LT((path.points.front().joints_rad - recording.joints_rad.front()).norm(), 1e-9);
  EXPECT_LT((path.points.back().joints_rad - recording.joints_rad.back()).norm(), 1e-8);
  EXPECT_LT((path.points[1].joints_rad - path.points[0].joints_rad).norm() / kPeriod_s, 0.1);
  EXPECT_LT(path.points[path.points.size() - 2].rates_radps.norm(), 0.1);
}

TEST(OperatorPath, PlaysASlowMotionAsFastAsItWasRecorded) {
  RecordedPath recording;
  for (int i = 0; i <= 100; ++i) recording.add(0.1 * i, 0.3 + 0.005 * i, -1.5 - 0.005 * i, -0.8 + 0.01 * i);
  const OperatorPath path = play(recording);
  EXPECT_NEAR(path.recorded_s, 10, 1e-9);
  EXPECT_GT(path.played_s, 10);
  EXPECT_LT(path.played_s, 11) << "only what starting and ending at rest takes";
  EXPECT_NEAR(path.points[1000].rates_radps[0], 0.05, 1e-6);
  EXPECT_EQ(path.notes.size(), 2u) << path.notes[1];
}

TEST(OperatorPath, StretchesTimeToTheJointsShareAndSaysByHowMuch) {
  RecordedPath recording;  // the boom, 0.8 rad in 1 s
  for (int i = 0; i <= 20; ++i) recording.add(0.1 * i, 0.1 + 0.8 * std::clamp((i - 5) / 10.0, 0.0, 1.0), -1.5, -0.8);
  const OperatorPath path = play(recording);
  const double factor = 0.8 / (kPathSpeedShare * test::solar().links[kBoom].max_rate_radps);
  ASSERT_GT(factor, 1.05);
  double fastest = 0;
  for (const sim::PathPoint& p : path.points) fastest = std::max(fastest, p.rates_radps[kBoom]);
  EXPECT_NEAR(fastest, kPathSpeedShare * test::solar().links[kBoom].max_rate_radps, 1e-3);
  EXPECT_GT(path.played_s, 2 + 0.9 * (factor - 1));
  EXPECT_TRUE(told(path, "s for boom speed (at most")) << path.notes.back();
}

TEST(OperatorPath, ScalesAnglesBeyondTheRangeLinearlyAboutItsMiddleAndSaysSo) {
  const LinkDescription& link = test::solar().links[kBucket];
  const double mid = (link.min_rad + link.max_rad) / 2;
  const double half = (link.max_rad - link.min_rad) / 2 - kPathRangeMargin_rad;
  RecordedPath recording;  // to 1.25 times the range on one side, 0.5 times on the other
  for (int i = 0; i <= 40; ++i) recording.add(0.2 * i, 0.3, -1.5, mid + half * (-0.5 + 1.75 * i / 40.0));
  const OperatorPath path = play(recording);
  EXPECT_NEAR(path.points.front().joints_rad[kBucket], mid - half * 0.5 / 1.25, 1e-8);
  EXPECT_NEAR(path.points.back().joints_rad[kBucket], mid + half, 1e-8);
  EXPECT_NEAR(path.points.back().joints_rad[kArm], -1.5, 1e-8) << "other joints stay as recorded";
  EXPECT_TRUE(told(path, "bucket: recorded")) << path.notes[0];
  EXPECT_TRUE(told(path, "scaled by 0.800"));
  EXPECT_FALSE(told(path, "arm: recorded"));
}

TEST(OperatorPath, LeavesOutLateRefreshesAndNamesTheirRowsButKeepsAStandstill) {
  RecordedPath stairs;  // 0.1 rad/s, refreshed every other row
  for (int i = 0; i <= 40; ++i) stairs.add(0.1 * i, 0.3 + 0.02 * (i / 2), -1.5 - 0.01 * i, -0.8 - 0.01 * i);
  const OperatorPath smooth = play(stairs);
  EXPECT_TRUE(told(smooth, "boom: 20 x late refresh (left out): row 3, 5, 7")) << smooth.notes[1];
  EXPECT_FALSE(told(smooth, "arm: 20 x"));
  for (std::size_t i = 150; i < 550; ++i) ASSERT_NEAR(smooth.points[i].rates_radps[kBoom], 0.1, 0.02) << i;

  RecordedPath pause;
  for (int i = 0; i <= 40; ++i) {
    const double way = 0.02 * (std::min(i, 10) + std::max(0, i - 30));  // stands still from 1 s to 3 s
    pause.add(0.1 * i, 0.3 + way, -1.5 - 0.01 * i, -0.8 - 0.01 * i);
  }
  const OperatorPath paused = play(pause);
  int still = 0;
  for (const sim::PathPoint& p : paused.points) still += std::abs(p.rates_radps[kBoom]) < 1e-6 ? 1 : 0;
  EXPECT_NEAR(still * kPeriod_s, 2.0, 0.1);
  EXPECT_FALSE(told(paused, "late refresh"));
}

TEST(OperatorPath, FillsAGapWithoutOvershootAndDoesNotWaitForALongOne) {
  RecordedPath recording;
  for (int i = 0; i <= 10; ++i) recording.add(0.1 * i, 0.3 + 0.01 * i, -1.5 - 0.01 * i, -0.8 - 0.01 * i);
  for (int i = 0; i <= 10; ++i) recording.add(61 + 0.1 * i, 0.6 + 0.01 * i, -1.8 - 0.01 * i, -1.1 - 0.01 * i);
  const OperatorPath path = play(recording);
  EXPECT_NEAR(path.recorded_s, 62, 1e-6);
  EXPECT_GT(path.played_s, 7);
  EXPECT_LT(path.played_s, 8);
  EXPECT_TRUE(told(path, "gap of 60.0 s before row 13: played in 5 s"));
  EXPECT_EQ(turns(joints_of(path), kBoom), 0);
  expect_within_limits(path);
}

TEST(OperatorPath, RefusesWhatHoldsNoMotionOfAllThreeJoints) {
  RecordedPath recording;
  for (int i = 0; i <= 20; ++i) recording.add(0.1 * i, 0.3, i < 18 ? std::nan("") : -1.5, -0.8);
  EXPECT_THROW((void)play(recording), InputError);
  recording = {};
  for (int i = 0; i <= 20; ++i) {
    recording.add(0.1 * i, i < 8 ? 0.3 + 0.01 * i : std::nan(""), i > 12 ? -1.5 - 0.01 * i : std::nan(""), -0.8);
  }
  EXPECT_THROW((void)play(recording), InputError);
}

TEST(OperatorPath, IsTheSameOfARecordingInOnePieceAndInParts) {
  const test::TemporaryFolder folder;
  const auto options = test::short_session("free_motion", 8);
  recording::RecorderOptions whole, parts;
  whole.file = folder.file("whole.mcap");
  parts.folder = folder.file("parts");
  parts.part_bytes = 600'000;
  parts.least_free_bytes = 0;
  (void)test::record(options, whole);
  (void)test::record(options, parts);
  std::vector<std::string> files;
  for (const recording::FileOfFolder& file : recording::files_in(parts.folder)) files.push_back(file.path);
  std::sort(files.begin(), files.end());
  ASSERT_GT(files.size(), 2u);
  const OperatorPath one = load_operator_path({whole.file}, "", test::solar());
  const OperatorPath joined = load_operator_path(files, "", test::solar());
  EXPECT_GT(joined.played_s, load_operator_path({files.front()}, "", test::solar()).played_s + 1);
  EXPECT_EQ(joined.played_s, one.played_s);
  ASSERT_EQ(joined.points.size(), one.points.size());
  for (std::size_t i = 0; i < one.points.size(); ++i)
    ASSERT_EQ(joined.points[i].joints_rad, one.points[i].joints_rad) << i;
}

TEST(OperatorPath, IsNamedByItsFileOrByTheParts) {
  const auto files = [](const std::string& operator_name) {
    SimulateOptions options;
    options.operator_name = operator_name;
    return options.operator_paths();
  };
  using Files = std::vector<std::string>;
  EXPECT_EQ(files("relaxed"), Files{});
  EXPECT_EQ(files("path:a,b.csv"), Files{"a,b.csv"});
  EXPECT_EQ(files("path:x/a_part001.mcap,a_part002.mcap,a_part003.mcap"),
            (Files{"x/a_part001.mcap", "a_part002.mcap", "a_part003.mcap"}));
  EXPECT_EQ(files("path:"), Files{""});
}

TEST(OperatorPath, PlaysTheRealDigCyclesWithinLimits) {
  const fs::path folder = fs::path(test::source_dir()) / ".." / "shared" / "data" / "excavator_dig_cycles";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "NOT TESTED: real recordings: no ../shared/data/excavator_dig_cycles";
  const std::string map = test::source_dir() + "/config/maps/excavator_dig_cycles.toml";
  int repeating = 0;
  for (int cycle = 326; cycle <= 374; cycle += 4) {
    const std::string file = folder / ("W2_data_" + std::to_string(cycle) + ".csv");
    SCOPED_TRACE(file);
    const OperatorPath path = load_operator_path({file}, map, test::solar());
    expect_within_limits(path);
    EXPECT_GT(path.played_s, 4);
    EXPECT_TRUE(told(path, "gap in time"));
    repeating += told(path, "repeated row (left out)") ? 1 : 0;
  }
  EXPECT_GT(repeating, 0);
}

}  // namespace
}  // namespace knuckle::session
