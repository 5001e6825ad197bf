// The papers' experiments on the simulated machine: what comes out, and that the reports show the papers' tables and
// figures.
#include "estimation/identification/baseline.h"

#include <gtest/gtest.h>

#include <sstream>

#include "app/identify/baseline_report.h"
#include "estimation/identification/static_poses.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"

namespace knuckle::identify {
namespace {

std::string page(Paper paper, const BaselineData& data) {
  std::ostringstream out;
  write_baseline_report(paper, test::solar(), data, out);
  return out.str();
}

const JointVector kStart(0.3, -1.5, -0.9);

BaselineRuns driven(Paper paper, const sim::MachineTruth& truth) {
  motion::MachineRun run(test::solar(), truth, {}, kStart, 1);
  return run_baseline(paper, test::solar(), run, 1);
}

std::vector<estimation::Recording> recordings(const std::vector<motion::MachineRecording>& runs) {
  std::vector<estimation::Recording> plain;
  for (const motion::MachineRecording& run : runs) plain.push_back(run.recording);
  return plain;
}

void expect_all(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) EXPECT_NE(text.find(part), std::string::npos) << part;
}

double ratio(const estimation::Identification& summary, const std::map<std::string, double>& truth,
             const std::string& name) {
  for (const estimation::IdentifiedParameter& p : summary.parameters) {
    if (p.name == name) return p.value / truth.at(name);
  }
  return 0;
}

TEST(Baselines, SlowMotionFindsGravityAndAnEmptyBucketWithinTwoHundredNewton) {
  const sim::MachineTruth truth = sim::sample_truth(test::solar(), 1);
  const BaselineRuns runs = driven(Paper::kKim, truth);
  BaselineData data{recordings(runs.identification),
                    recordings(runs.verification),
                    baseline_truth(Paper::kKim, test::solar(), truth, runs),
                    {}};
  const estimation::KimResult result = identify_kim(test::solar(), data.identification);
  ASSERT_TRUE(result.summary.usable);
  EXPECT_NEAR(ratio(result.summary, data.truth, "m1 L_O1G1"), 1, 0.05);
  EXPECT_NEAR(ratio(result.summary, data.truth, "m2 L_O2G2"), 1, 0.15);
  EXPECT_NEAR(ratio(result.summary, data.truth, "m3 L_O3G3"), 1, 0.1);
  double squares = 0, count = 0;
  for (const PlanarVector& force : external_force(result, test::solar(), data.verification[0])) {
    if (!force.allFinite()) continue;
    squares += force.squaredNorm();
    ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 100);
  EXPECT_GT(std::sqrt(squares / count), 10);  // friction without Coulomb cannot be that good
  data.verdict = result.summary;
  const std::string text = page(Paper::kKim, data);
  expect_all(text, {">usable<", "Table 1", "Figure 4", "Figure 7 (b)", "Figure 8", "</svg>", "</html>"});
  data.verdict.usable = false;
  data.verdict.reasons = {"held-out motion speaks against it"};
  expect_all(page(Paper::kKim, data), {">not usable<", "held-out motion speaks against it", "Table 1"});
}

TEST(Baselines, RodNoiseIsWhatPullsTheInertiasOfTheFilteredRegressorDown) {
  const std::vector<InertiaBias> bias = malaguti_bias(test::solar(), 4, 1);
  ASSERT_EQ(bias.size(), 4U);
  const auto &as_read = bias[0], &exact = bias[1], &noisy = bias[2], &repaired = bias[3];
  EXPECT_LT(as_read.stick[0], 0.8);
  EXPECT_LT(as_read.bucket[0], 0.8);
  EXPECT_NEAR(exact.stick[0], 1, 0.15);
  EXPECT_NEAR(exact.bucket[0], 1, 0.3);
  EXPECT_LT(noisy.stick[0], 0.2);
  EXPECT_LT(noisy.bucket[0], 0.2);
  EXPECT_NEAR(repaired.stick[0], 1, 0.2);
  EXPECT_EQ(as_read.intervals, 6);
  EXPECT_LE(as_read.covered, 2);  // naive intervals do not tell
}

TEST(Baselines, DiggingInTheAirGivesTablesTwoAndThree) {
  const sim::MachineTruth truth = sim::sample_truth(test::solar(), 1);
  const BaselineRuns runs = driven(Paper::kMalaguti, truth);
  const BaselineData data{recordings(runs.identification),
                          recordings(runs.verification),
                          baseline_truth(Paper::kMalaguti, test::solar(), truth, runs),
                          {}};
  const estimation::MalagutiResult result = identify_malaguti(test::solar(), data.identification);
  ASSERT_TRUE(result.summary.usable);
  EXPECT_NEAR(ratio(result.summary, data.truth, "phi_S1"), 1, 0.1);
  EXPECT_NEAR(ratio(result.summary, data.truth, "phi_S3"), 1, 0.05);
  const estimation::TorqueFit fit = torque_fit(compare_torque(result, test::solar(), data.verification[0]), 2);
  EXPECT_LT(fit.nrmse[kArm], 0.15);
  EXPECT_LT(fit.nrmse[kBucket], 0.15);
  EXPECT_TRUE(std::isnan(fit.nrmse[kBoom]));
  const std::string text = page(Paper::kMalaguti, data);
  expect_all(text, {"Table 2", "Table 3", "Figure 3", "Figure 4", "</svg>"});
}

TEST(Baselines, FewPosesAreReportedAsNotUsable) {
  BaselineData none;
  none.verdict = estimation::identify_static(test::solar(), {}).summary;
  const std::string text = page(Paper::kStatic, none);
  expect_all(text, {">not usable<", "0 poses at rest", "</html>"});
}

TEST(DeepBaselines, PosesAtRestGiveTheMomentsButForFrictionAndOffsets) {
  const sim::MachineTruth truth = sim::sample_truth(test::solar(), 1);
  const BaselineRuns runs = driven(Paper::kStatic, truth);
  const auto values = baseline_truth(Paper::kStatic, test::solar(), truth, runs);
  const estimation::StaticResult result = identify_static(test::solar(), recordings(runs.identification));
  EXPECT_TRUE(result.summary.usable);
  EXPECT_GE(result.poses, 150);
  for (const estimation::IdentifiedParameter& p : result.summary.parameters) {
    EXPECT_NEAR(p.value, values.at(p.name), 6) << p.name;  // 1 bar of offset is some 300 N of a cylinder
    EXPECT_GT(p.sigma, 0.01) << p.name;
  }
  // Other poses, by the same rule: a torque to judge it by.
  const auto torque = compare_torque(result, test::solar(), runs.verification.at(0).recording);
  for (const int joint : {kArm, kBucket}) {
    EXPECT_LT(torque_fit(torque, 0).nrmse[joint], 0.15);
    EXPECT_GT(torque_fit(torque, 0).nrmse[joint], 0.01);  // friction is in the measured torque
  }
}

}  // namespace
}  // namespace knuckle::identify
