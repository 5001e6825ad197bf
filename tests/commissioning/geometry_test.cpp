// Kinematic calibration on drawn machines whose linkage the simulator computes.
#include <gtest/gtest.h>

#include <algorithm>

#include "drawn_survey.h"
#include "estimation/identification/kinematic_calibration.h"
#include "machine/kinematics.h"
#include "machine/load.h"

namespace knuckle::app {
namespace {

using estimation::calibrate_geometry;
using estimation::GeometryResult;
using estimation::Survey;
using estimation::survey_poses;

constexpr double kSigma_m = 1e-3;
constexpr std::size_t kPoses = 30;

MachineDescription drawing() {
  return load_machine(find_config("machine", "solar015"));
}

/// Against the truth at poses that were not surveyed.
struct TrueErrors {
  JointVector lever_rel = JointVector::Zero();
  double tip_rms_m = 0;
};

TrueErrors true_errors(const MachineDescription& seen, const sim::MachineTruth& truth) {
  const Kinematics kinematics(seen);
  JointVector squares = JointVector::Zero(), levers = JointVector::Zero();
  TrueErrors errors;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> part(0.03, 0.97);
  constexpr int kChecks = 50;
  for (int n = 0; n < kChecks; ++n) {
    JointVector pose, angle;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = truth.machine.links[static_cast<std::size_t>(i)];
      pose[i] = link.min_rad + part(random) * (link.max_rad - link.min_rad);
    }
    const TrueCylinders cylinders = true_cylinders(truth.machine, pose);
    for (int i = 0; i < kJoints; ++i) {
      const double reading = cylinders.length_m[i] + truth.encoder_offset_m[i];
      angle[i] = kinematics.joint_at(i, reading - seen.sensors.encoder_offset_m[i]).value();
      squares[i] += std::pow(kinematics.cylinder_at(i, angle[i]).value().lever_m - cylinders.lever_m[i], 2);
      levers[i] += std::pow(cylinders.lever_m[i], 2);
    }
    errors.tip_rms_m += (kinematics.tip(angle) - true_points(truth.machine, pose)[kBucket]).squaredNorm() / kChecks;
  }
  errors.lever_rel = (squares.array() / levers.array()).sqrt();
  errors.tip_rms_m = std::sqrt(errors.tip_rms_m);
  return errors;
}

MachineDescription seen_after(const GeometryResult& result) {
  MachineDescription machine = drawing();
  machine.geometry_calibration = result.geometry;
  return calibrated(machine);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Levers as good as those of a machine whose pins are known to 0.5 mm: the force targets ask for that.
TEST(Geometry, SurveyMakesLeversAsIfPinsWereKnownToHalfAMillimetre) {
  const MachineDescription machine = drawing();
  const auto poses = survey_poses(machine, kPoses);
  std::vector<double> share[kJoints], tip_mm;
  double inside = 0, told = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const sim::MachineTruth truth = sim::draw_truth(machine, seed);
    const GeometryResult result = calibrate_geometry(machine, drawn_survey(truth, machine, poses, kSigma_m, seed));
    ASSERT_TRUE(result.summary.usable) << "machine " << seed << ": " << result.summary.reasons.front();
    const TrueErrors before = true_errors(machine, truth), after = true_errors(seen_after(result), truth);
    for (int i = 0; i < kJoints; ++i) share[i].push_back(after.lever_rel[i] / before.lever_rel[i]);
    tip_mm.push_back(1e3 * after.tip_rms_m);
    // Held-out tips carry the surveyor's error of 1.4 mm in the plane on top.
    EXPECT_NEAR(result.held_out.rms_m, std::hypot(std::sqrt(2.0) * kSigma_m, after.tip_rms_m), 0.6e-3);
    const double true_mm[] = {1e3 * truth.machine.links[kBoom].length_m, 1e3 * truth.machine.links[kArm].length_m,
                              1e3 * truth.machine.links[kBucket].length_m};
    for (std::size_t i = 0; i < kJoints; ++i) {
      inside += std::abs(true_mm[i] - result.summary.parameters[i].value) < 1.96 * result.summary.parameters[i].sigma;
      ++told;
    }
  }
  for (const auto& s : share) EXPECT_LT(median(s), 0.5 / 2);  // drawn: +-2 mm
  EXPECT_LT(median(tip_mm), 1.0);
  EXPECT_GT(inside / told, 0.85) << "95 % intervals of the link lengths";
}

TEST(Geometry, WhatASurveyCannotTellApartStaysAsDrawnAndIsNamed) {
  const MachineDescription machine = drawing();
  const sim::MachineTruth truth = sim::draw_truth(machine, 3);
  const GeometryResult result =
      calibrate_geometry(machine, drawn_survey(truth, machine, survey_poses(machine, kPoses), kSigma_m, 3));
  ASSERT_TRUE(result.summary.usable);
  // Points show joint angles: a triangle's two pins may turn together, and an offset hides in the pins' distance.
  EXPECT_LT(result.summary.rank, result.summary.columns);
  EXPECT_EQ(result.summary.indistinct.size(), static_cast<std::size_t>(result.summary.columns - result.summary.rank));
  const auto& offset = result.summary.parameters[19];
  EXPECT_EQ(offset.name, "boom encoder offset");
  EXPECT_GT(offset.sigma, 0.25) << "mm; the drawing's 0.3";
  EXPECT_LT(result.lever[kBoom].calibrated_rel, 0.2 * result.lever[kBoom].drawing_rel);
}

TEST(Geometry, TipAloneIsEnough) {
  const MachineDescription machine = drawing();
  const sim::MachineTruth truth = sim::draw_truth(machine, 5);
  Survey survey = drawn_survey(truth, machine, survey_poses(machine, kPoses), kSigma_m, 5);
  for (auto& pose : survey.poses) pose.arm_pin_m = pose.bucket_pin_m = PlanarVector::Constant(std::nan(""));
  const GeometryResult result = calibrate_geometry(machine, survey);
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  EXPECT_LT(true_errors(seen_after(result), truth).tip_rms_m, 1.5e-3);
  EXPECT_LT(result.held_out.rms_m, 0.3 * result.drawing.rms_m);
}

TEST(Geometry, PosesKeepOffSoftMarginsAndVirtualWalls) {
  const MachineDescription machine = drawing();
  const Kinematics kinematics(machine);
  const auto poses = survey_poses(machine, 40);
  ASSERT_EQ(poses.size(), 40u);
  for (const JointVector& pose : poses) {
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
      EXPECT_GT(pose[i], link.min_rad + machine.limits.joint_soft_margin_rad);
      EXPECT_LT(pose[i], link.max_rad - machine.limits.joint_soft_margin_rad);
    }
    EXPECT_GT(kinematics.tip(pose).y(), machine.limits.floor_m);
    EXPECT_LT(kinematics.tip(pose).y(), machine.limits.ceiling_m);
    EXPECT_LT(kinematics.tip(pose).x(), machine.limits.reach_m);
  }
}

}  // namespace
}  // namespace knuckle::app
