// Real dig cycles: geometry behind angles and tip, and labels that cannot be right.
#include "app/studies/dig_cycles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "app/studies/channel_plausibility.h"
#include "core/error.h"
#include "tests/support/places.h"

namespace knuckle::studies {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Links 5, 2.5 and 1.5 m; the bucket driven by a four-bar from the rocker's angle; tips as of `latency_s` ago.
std::vector<TipSample> made_up_digging(double latency_s, double noise_m, std::size_t count) {
  TipGeometry truth;
  truth.value = {0.1, -0.2, 5, 0.02, 2.5, -0.03, 1.5, -0.93, -0.72, 0.83, 0.09, 2.0, latency_s};
  truth.branch = 1;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, noise_m);
  std::vector<TipSample> samples;
  for (std::size_t n = 0; n < count; ++n) {
    const double t = 0.1 * static_cast<double>(n);
    const JointVector phase(0.31 * t, 0.23 * t, 0.41 * t);
    TipSample s;
    s.angle_rad = kDegree * JointVector(20 + 12 * std::sin(phase[0]), -80 + 30 * std::sin(phase[1]),
                                        70 + 35 * std::sin(phase[2]));
    s.rate_radps = kDegree * JointVector(12 * 0.31 * std::cos(phase[0]), 30 * 0.23 * std::cos(phase[1]),
                                         35 * 0.41 * std::cos(phase[2]));
    const double dx = noise(random);
    s.tip_m = truth.tip(s) + PlanarVector(dx, noise(random));
    samples.push_back(s);
  }
  return samples;
}

TEST(TipGeometry, FindsLinksLinkageAndLatencyThroughNoiseAndOutliers) {
  std::vector<TipSample> samples = made_up_digging(0.12, 2e-3, 600);
  for (std::size_t i = 7; i < samples.size(); i += 20) samples[i].tip_m.x() += 0.8;  // one in twenty
  const auto fit = fit_tip_geometry(samples);
  ASSERT_TRUE(fit);
  // What noise leaves open is as wide as told: a shorter bucket on another linkage looks much the same.
  const double expected[] = {5, 2.5, 1.5, 0.12};
  const TipGeometry::Index index[] = {TipGeometry::kBoom_m, TipGeometry::kArm_m, TipGeometry::kBucket_m,
                                      TipGeometry::kLatency_s};
  const double most[] = {0.02, 0.15, 0.3, 0.01};  // of sigma
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(fit->value[index[i]], expected[i], 4 * fit->sigma[index[i]]) << "unknown " << index[i];
    EXPECT_LT(fit->sigma[index[i]], most[i]) << "unknown " << index[i];
  }
  const std::vector<TipSample> clean = made_up_digging(0.12, 0, 900);
  double worst = 0;
  for (const TipSample& s : clean) worst = std::max(worst, (fit->tip(s) - s.tip_m).norm());
  EXPECT_LT(worst, 3e-3);
}

TEST(TipGeometry, RefusesTooFewSamples) {
  EXPECT_FALSE(fit_tip_geometry(made_up_digging(0, 0, 20)));
}

/// One cycle of a machine that digs with 2 MPa on the arm's and bucket's head sides and pushes the boom up.
recordings::MappedTable made_up_cycle(double phase) {
  recordings::MappedTable cycle;
  cycle.gap_s = 0.5;
  std::vector<std::string> names{"boom_rad",    "arm_rad",    "bucket_rad",     "bucket_joint_rad",
                                 "tip_x_m",     "tip_z_m",    "boom_head_Pa",   "boom_rod_Pa",
                                 "arm_head_Pa", "arm_rod_Pa", "bucket_head_Pa", "bucket_rod_Pa"};
  for (const std::string& name : names) cycle.channels.push_back({name, {}});
  for (int n = 0; n < 60; ++n) {
    const double t = 0.1 * n + phase, dig = n < 40 ? 1 : 0, dug = std::min(n, 40);  // then in the air
    const std::array<double, 12> row{0.3 + 0.002 * n,
                                     -1.2 - 0.01 * dug,
                                     1.2 - 0.01 * dug,
                                     -1.1 - 0.01 * dug,
                                     4 + std::sin(t),
                                     dig > 0 ? -2 : 0.5,
                                     18e6,
                                     2e6,
                                     dig > 0 ? 15e6 : 2e6,
                                     dig > 0 ? 2e6 : 15e6,
                                     16e6,
                                     3e6};
    cycle.time_s.push_back(0.1 * n);
    for (std::size_t c = 0; c < row.size(); ++c) cycle.channels[c].values.push_back(row[c]);
  }
  return cycle;
}

TEST(ChannelPlausibility, SeesExchangedSidesOfEachCylinder) {
  std::vector<recordings::MappedTable> cycles;
  for (int i = 0; i < 10; ++i) cycles.push_back(made_up_cycle(i));
  for (const SideVerdict& v : judge_sides(cycles)) {
    EXPECT_FALSE(v.exchanged) << v.joint;
    EXPECT_GT(v.confidence, 0.9) << v.joint;
  }
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    auto swapped = cycles;
    for (recordings::MappedTable& c : swapped)
      std::swap(c.channels[6 + 2 * joint].values, c.channels[7 + 2 * joint].values);
    const auto verdicts = judge_sides(swapped);
    for (std::size_t i = 0; i < kJoints; ++i) {
      EXPECT_EQ(verdicts[i].exchanged, i == joint) << i;
      EXPECT_GT(verdicts[i].confidence, 0.9) << i;
    }
  }
}

TEST(DigCycles, FolderWithoutRecordingsIsRefused) {
  const std::string empty = ::testing::TempDir() + "knuckle_no_cycles";
  std::filesystem::create_directories(empty);
  EXPECT_THROW((void)read_dig_cycles(empty), InputError);
  EXPECT_THROW((void)read_dig_cycles(empty + "/not_there"), InputError);
}

/// The real cycles, or nothing where they are absent.
std::string real_cycles() {
  const std::filesystem::path dir = std::filesystem::path(test::source_dir()) / "../shared/data/excavator_dig_cycles";
  return std::filesystem::is_directory(dir) ? dir.string() : std::string();
}

double value_of(const std::vector<RealRow>& rows, const std::string& quantity) {
  for (const RealRow& row : rows) {
    if (row.quantity == quantity) return row.value;
  }
  ADD_FAILURE() << "no row " << quantity;
  return std::nan("");
}

/// A folder with every third recording, or with the others.
std::string part_of(const std::string& dir, bool held_out) {
  const std::string part = ::testing::TempDir() + (held_out ? "knuckle_dig_test" : "knuckle_dig_train");
  std::filesystem::remove_all(part);
  std::filesystem::create_directories(part);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(dir)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size(); ++i) {
    if ((i % 3 == 2) == held_out) std::filesystem::create_symlink(files[i], part + "/" + files[i].filename().string());
  }
  return part;
}

TEST(DigCycles, HeldOutTipAndLabelsOfARealExcavator) {
  const std::string dir = real_cycles();
  if (dir.empty()) GTEST_SKIP() << "no real recordings here: ../shared/data is absent";
  const auto rows = dig_cycle_rows(part_of(dir, false), part_of(dir, true));
  EXPECT_LT(value_of(rows, "held-out tip error, median"), 0.001);
  EXPECT_LT(value_of(rows, "held-out tip error, RMS"), 0.002);
  EXPECT_GT(value_of(rows, "boom head and rod exchanged, confidence"), 0.9);
  EXPECT_LT(value_of(rows, "arm head and rod exchanged, confidence"), 0.1);
  EXPECT_LT(value_of(rows, "bucket head and rod exchanged, confidence"), 0.1);
  EXPECT_GT(value_of(rows, "found: drop-out (not used)"), 0);
}

}  // namespace
}  // namespace knuckle::studies
