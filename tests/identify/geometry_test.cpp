// Kinematic calibration on sampled machines whose linkage the simulator computes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "estimation/identification/kinematic_calibration.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "sampled_survey.h"

namespace knuckle::identify {
namespace {

using estimation::calibrate_geometry;
using estimation::GeometryResult;
using estimation::Survey;
using estimation::survey_poses;

constexpr double kSigma_m = 1e-3;
constexpr std::size_t kPoses = 30;

MachineDescription nominal_machine() {
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
  int checked = 0;
  for (int n = 0; n < 50; ++n) {
    JointVector pose, angle;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = truth.machine.links[static_cast<std::size_t>(i)];
      pose[i] = link.min_rad + part(random) * (link.max_rad - link.min_rad);
    }
    const TrueCylinders cylinders = true_cylinders(truth.machine, pose);
    const JointVector length = cylinders.length_m + truth.encoder_offset_m - seen.sensors.encoder_offset_m;
    // At an end of the range the drawing may have no angle for a reading of the real machine.
    bool has_angles = true;
    for (int i = 0; i < kJoints; ++i) {
      const auto found = kinematics.joint_at(i, length[i]);
      has_angles = has_angles && found;
      angle[i] = found.value_or(0);
    }
    if (!has_angles) continue;
    ++checked;
    for (int i = 0; i < kJoints; ++i) {
      squares[i] += std::pow(kinematics.cylinder_at(i, angle[i]).value().lever_m - cylinders.lever_m[i], 2);
      levers[i] += std::pow(cylinders.lever_m[i], 2);
    }
    errors.tip_rms_m += (kinematics.tip(angle) - true_points(truth.machine, pose)[kBucket]).squaredNorm();
  }
  EXPECT_GT(checked, 40);
  errors.tip_rms_m /= checked;
  errors.lever_rel = (squares.array() / levers.array()).sqrt();
  errors.tip_rms_m = std::sqrt(errors.tip_rms_m);
  return errors;
}

MachineDescription seen_after(const GeometryResult& result, MachineDescription machine = nominal_machine()) {
  machine.geometry_calibration = result.geometry;
  return calibrated(machine);
}

double quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

// Levers as good as those of a machine whose pins are known to 0.5 mm: the force targets ask for that.
TEST(Geometry, SurveyMakesLeversAsIfPinsWereKnownToHalfAMillimetre) {
  const MachineDescription machine = nominal_machine();
  const auto poses = survey_poses(machine, kPoses);
  std::vector<double> share[kJoints], tip_mm;
  double inside = 0, told = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const sim::MachineTruth truth = sim::sample_truth(machine, seed);
    const GeometryResult result = calibrate_geometry(machine, sampled_survey(truth, machine, poses, kSigma_m, seed));
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
  for (const auto& s : share) EXPECT_LT(quantile(s, 0.5), 0.5 / 2);  // drawn: +-2 mm
  EXPECT_LT(quantile(tip_mm, 0.5), 1.0);
  EXPECT_GT(inside / told, 0.85) << "95 % intervals of the link lengths";
}

// Errors of levers: median / 95th percentile of machines.
TEST(DeepGeometry, TwoHundredMachinesOfEachDrawingAreAsIfPinsWereKnownToHalfAMillimetre) {
  for (const char* name : {"solar015", "compact080"}) {
    const MachineDescription machine = load_machine(find_config("machine", name));
    const auto poses = survey_poses(machine, kPoses);
    std::vector<double> nominal_rel[kJoints], calibrated_rel[kJoints], tip_mm;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      const sim::MachineTruth truth = sim::sample_truth(machine, seed);
      const GeometryResult result = calibrate_geometry(machine, sampled_survey(truth, machine, poses, kSigma_m, seed));
      ASSERT_TRUE(result.summary.usable) << name << " " << seed << ": " << result.summary.reasons.front();
      const TrueErrors before = true_errors(machine, truth), after = true_errors(seen_after(result, machine), truth);
      for (int i = 0; i < kJoints; ++i) {
        nominal_rel[i].push_back(100 * before.lever_rel[i]);
        calibrated_rel[i].push_back(100 * after.lever_rel[i]);
      }
      tip_mm.push_back(1e3 * after.tip_rms_m);
    }
    for (int i = 0; i < kJoints; ++i) {
      std::printf("%s %s lever: drawing %.2f / %.2f %%, calibrated %.3f / %.3f %%\n", name,
                  kJointNames[static_cast<std::size_t>(i)], quantile(nominal_rel[i], 0.5),
                  quantile(nominal_rel[i], 0.95), quantile(calibrated_rel[i], 0.5), quantile(calibrated_rel[i], 0.95));
      EXPECT_LT(quantile(calibrated_rel[i], 0.95), 0.5 / 2 * quantile(nominal_rel[i], 0.95));
    }
    std::printf("%s tip: %.2f / %.2f mm\n", name, quantile(tip_mm, 0.5), quantile(tip_mm, 0.95));
  }
}

TEST(Geometry, WhatASurveyCannotTellApartStaysAsDrawnAndIsNamed) {
  const MachineDescription machine = nominal_machine();
  const sim::MachineTruth truth = sim::sample_truth(machine, 3);
  const GeometryResult result =
      calibrate_geometry(machine, sampled_survey(truth, machine, survey_poses(machine, kPoses), kSigma_m, 3));
  ASSERT_TRUE(result.summary.usable);
  // Points show joint angles: a triangle's two pins may turn together, and an offset hides in the pins' distance.
  EXPECT_LT(result.summary.rank, result.summary.columns);
  EXPECT_EQ(result.summary.indistinct.size(), static_cast<std::size_t>(result.summary.columns - result.summary.rank));
  const auto& offset = result.summary.parameters[19];
  EXPECT_EQ(offset.name, "boom encoder offset");
  EXPECT_GT(offset.sigma, 0.25) << "mm; the drawing's 0.3";
}

TEST(Geometry, TipAloneIsEnough) {
  const MachineDescription machine = nominal_machine();
  const sim::MachineTruth truth = sim::sample_truth(machine, 5);
  Survey survey = sampled_survey(truth, machine, survey_poses(machine, kPoses), kSigma_m, 5);
  for (auto& pose : survey.poses) pose.arm_pin_m = pose.bucket_pin_m = PlanarVector::Constant(std::nan(""));
  const GeometryResult result = calibrate_geometry(machine, survey);
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  EXPECT_LT(true_errors(seen_after(result), truth).tip_rms_m, 1.5e-3);
  EXPECT_LT(result.held_out.rms_m, 0.3 * result.nominal.rms_m);
}

TEST(Geometry, PosesKeepOffSoftMarginsAndVirtualWalls) {
  const MachineDescription machine = nominal_machine();
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
}  // namespace knuckle::identify
