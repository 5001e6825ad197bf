// Surveys that are wrong: named by pose, or refused with the mistake that explains them.
#include <gtest/gtest.h>

#include "estimation/identification/kinematic_calibration.h"
#include "machine/load.h"
#include "sampled_survey.h"
#include "tests/support/says.h"
#include "tests/support/solar.h"

namespace knuckle::identify {
namespace {

using estimation::calibrate_geometry;
using estimation::GeometryResult;
using estimation::Survey;
using test::says;

Survey good_survey(std::size_t poses = 30) {
  return sampled_survey(sim::sample_truth(test::solar(), 11), test::solar(),
                        estimation::survey_poses(test::solar(), poses), 1e-3, 11);
}

/// The first reason of a refusal; "accepted" where there is none.
std::string refusal(const Survey& survey) {
  const GeometryResult result = calibrate_geometry(test::solar(), survey);
  if (result.summary.usable) return "accepted";
  EXPECT_EQ(result.geometry.length_m[kBoom], test::solar().links[kBoom].length_m) << "a refusal leaves the drawing";
  return result.summary.reasons.empty() ? "no reason" : result.summary.reasons.front();
}

TEST(GeometryRefusal, OutlyingPointIsNamedAndLeftOut) {
  const GeometryResult clean = calibrate_geometry(test::solar(), good_survey());
  ASSERT_TRUE(clean.summary.usable);
  EXPECT_TRUE(clean.left_out.empty());
  Survey survey = good_survey();
  survey.poses[6].tip_m.x() += 0.012;          // a misread prism
  survey.poses[20].bucket_pin_m.y() -= 0.5;    // a wrong pin altogether
  survey.poses[25].cylinder_m[kBoom] += 0.01;  // a slipped wire: all three points are off
  const GeometryResult result = calibrate_geometry(test::solar(), survey);
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  ASSERT_EQ(result.left_out.size(), 5u);
  EXPECT_TRUE(says(result.left_out[0], "pose 21: bucket pin is 0."));
  EXPECT_TRUE(says(result.left_out[1], "pose 7: tip is 1"));
  for (std::size_t i = 2; i < 5; ++i) EXPECT_TRUE(says(result.left_out[i], "pose 26: "));
  EXPECT_NEAR(result.geometry.length_m[kBoom], clean.geometry.length_m[kBoom], 0.3e-3);
  EXPECT_NEAR(result.held_out.rms_m, clean.held_out.rms_m, 0.3e-3);
}

TEST(GeometryRefusal, TooFewAndIdenticalPoses) {
  EXPECT_EQ(refusal(good_survey(5)), "5 different poses of 5; at least 8 are needed");
  Survey same = good_survey();
  for (auto& pose : same.poses) pose = same.poses.front();
  EXPECT_EQ(refusal(same), "1 different poses of 30; at least 8 are needed");
  EXPECT_TRUE(says(refusal(Survey{}), "0 different poses of 0"));
}

TEST(GeometryRefusal, JointThatHardlyMoved) {
  auto poses = estimation::survey_poses(test::solar(), 30);
  for (JointVector& pose : poses) pose[kArm] = -1.5 + 0.05 * pose[kArm];
  EXPECT_TRUE(says(refusal(sampled_survey(sim::sample_truth(test::solar(), 11), test::solar(), poses, 1e-3, 11)),
                   "the arm moved over "));
}

TEST(GeometryRefusal, WrongUnitMirroredAxisAndSwappedColumnsAreTold) {
  struct Mistake {
    void (*make)(estimation::SurveyPose&);
    const char *seen, *told;
  };
  for (const Mistake& mistake :
       {Mistake{[](auto& pose) { pose.tip_m *= 1e3; }, "tip is ", "looks in millimetres"},
        {[](auto& pose) { pose.arm_pin_m.x() *= -1; }, "", "looks with x mirrored"},
        {[](auto& pose) { pose.tip_m.y() *= -1; }, "", "looks with z mirrored"},
        {[](auto& pose) { std::swap(pose.arm_pin_m, pose.bucket_pin_m); }, "arm pin is ", "looks like the bucket pin"},
        {[](auto& pose) { pose.cylinder_m *= 1e3; }, "boom encoder reads", "looks like millimetres"}}) {
    Survey survey = good_survey();
    for (auto& pose : survey.poses) mistake.make(pose);
    const std::string said = refusal(survey);
    EXPECT_TRUE(says(said, mistake.seen));
    EXPECT_TRUE(says(said, mistake.told));
  }
}

// The frame's origin belongs on the boom pin; a survey from elsewhere does not fit any pins near the drawing's.
TEST(GeometryRefusal, OriginBesideTheBoomPinIsNotTakenForGeometry) {
  Survey survey = good_survey();
  for (auto& pose : survey.poses) {
    for (PlanarVector* point : {&pose.arm_pin_m, &pose.bucket_pin_m, &pose.tip_m}) *point += PlanarVector(0.03, 0.02);
  }
  const GeometryResult result = calibrate_geometry(test::solar(), survey);
  EXPECT_TRUE(!result.summary.usable || result.residual_ratio > 2);
  EXPECT_FALSE(result.summary.reasons.empty());
}

TEST(GeometryRefusal, TooSmallASigmaOfTheSurveyIsSeenAndWidensTheIntervals) {
  Survey survey = sampled_survey(sim::sample_truth(test::solar(), 11), test::solar(),
                                 estimation::survey_poses(test::solar(), 30), 4e-3, 11);
  const double honest = calibrate_geometry(test::solar(), survey).summary.parameters[0].sigma;
  survey.point_sigma_m = 1e-3;
  const GeometryResult result = calibrate_geometry(test::solar(), survey);
  ASSERT_TRUE(result.summary.usable);
  EXPECT_NEAR(result.residual_ratio, 4, 0.6);
  ASSERT_FALSE(result.summary.reasons.empty());
  EXPECT_TRUE(says(result.summary.reasons.back(), "sigmas are scaled up"));
  EXPECT_NEAR(result.summary.parameters[0].sigma, honest, 0.3 * honest);
}

}  // namespace
}  // namespace knuckle::identify
