// Raw recordings to off-line signals; figures of merit of modelled torque.
#include "estimation/identification/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimation/identification/identification.h"
#include "tests/identification/synthetic.h"

namespace knuckle::estimation {
namespace {

TEST(OfflineMotion, GivesAnglesAndRatesOfACleanRecording) {
  const MachineDescription machine = test_machine();
  const SineMotion motion;
  for (const auto smooth : {MotionOptions::Smooth::kCylinderLength, MotionOptions::Smooth::kJointAngle}) {
    MotionOptions options;
    options.smooth = smooth;
    const Motion m = offline_motion(machine, recorded(machine, motion, 4, 0.005), options);
    ASSERT_EQ(m.stretches.size(), 1U);
    EXPECT_EQ(m.stretches[0].first, 20);
    for (Eigen::Index i = m.stretches[0].first; i < m.stretches[0].end; i += 7) {
      const SineMotion::Point p = motion.at(0.005 * static_cast<double>(i));
      EXPECT_LT((m.joint_rad.col(i) - p.angle).norm(), 1e-5);
      EXPECT_LT((m.joint_radps.col(i) - p.rate).norm(), 2e-3);
      EXPECT_LT((m.cylinder_mps.col(i) - m.lever_m.col(i).cwiseProduct(m.joint_radps.col(i))).norm(), 1e-12);
    }
    EXPECT_TRUE(std::isnan(m.joint_rad(0, 19)));
  }
}

TEST(OfflineMotion, TakesEncoderOffsetsOff) {
  MachineDescription machine = test_machine();
  Recording recording = recorded(machine, SineMotion{}, 1, 0.005);
  const double before = offline_motion(machine, recording).joint_rad(kBoom, 100);
  machine.sensors.encoder_offset_m[kBoom] = 1e-3;
  for (Measurement& m : recording.samples) m.cylinder_m[kBoom] += 1e-3;
  EXPECT_NEAR(offline_motion(machine, recording).joint_rad(kBoom, 100), before, 1e-12);
}

TEST(OfflineMotion, LinksStayBehindTheirEncodersByTheTorquesOfTheirCylinders) {
  const MachineDescription machine = test_machine();
  const Recording recording = recorded(machine, SineMotion{}, 2, 0.005);
  MotionOptions options;
  options.compliance_radpNm = JointVector(1e-6, 0, 3e-6);
  const Motion stiff = offline_motion(machine, recording), m = offline_motion(machine, recording, options);
  for (Eigen::Index i = 100; i < 200; i += 9) {
    const JointVector torque_Nm = stiff.lever_m.col(i).cwiseProduct(stiff.smooth_cylinder_N.col(i));
    const JointVector behind = options.compliance_radpNm.cwiseProduct(torque_Nm);
    ASSERT_GT(std::abs(behind[kBoom]), 1e-4);
    EXPECT_LT((stiff.joint_rad.col(i) - m.joint_rad.col(i) - behind).norm(), 0.02 * behind.norm());
  }
}

TEST(OfflineMotion, NeverBridgesGaps) {
  const MachineDescription machine = test_machine();
  Recording recording = recorded(machine, SineMotion{}, 3, 0.005);
  recording.usable[200] = 0;
  recording.samples[400].pressure_Pa[3] = std::numeric_limits<double>::quiet_NaN();
  recording.samples[500].cylinder_m[kArm] = 3;  // no angle gives that length
  const Motion m = offline_motion(machine, recording);
  ASSERT_EQ(m.stretches.size(), 4U);
  EXPECT_EQ(m.stretches[0].end, 180);
  EXPECT_EQ(m.stretches[1].first, 221);
  EXPECT_EQ(m.stretches[1].end, 380);
  EXPECT_EQ(m.stretches[2].end, 480);
}

TEST(OfflineMotion, KeepsItsWindowInSecondsAtAnyRate) {
  EXPECT_EQ(half_window(0.205, 0.005), 20);
  EXPECT_EQ(half_window(0.205, 0.01), 10);
  EXPECT_EQ(half_window(0.205, 1), 1);
}

TEST(OfflineMotion, TakesThePressureLagOff) {
  const MachineDescription machine = test_machine();
  Recording recording = recorded(machine, SineMotion{}, 6, 0.005);
  const Motion fast = offline_motion(machine, recording);
  const double lag_s = 0.02;
  std::vector<FohFilter<double>> lags(6, FohFilter<double>(1 / (2 * std::numbers::pi * lag_s), 0.005));
  for (std::size_t k = 0; k < 6; ++k) lags[k].reset(recording.samples[0].pressure_Pa[k]);
  for (Measurement& m : recording.samples)
    for (std::size_t k = 0; k < 6; ++k) m.pressure_Pa[k] = lags[k].step(m.pressure_Pa[k]);
  MotionOptions options;
  const Motion late = offline_motion(machine, recording, options);
  options.pressure_lag_s = lag_s;
  const Motion repaired = offline_motion(machine, recording, options);
  double raw = 0, left = 0;
  for (Eigen::Index i = 200; i < 1000; ++i) {
    raw += (late.cylinder_N.col(i) - fast.cylinder_N.col(i)).squaredNorm();
    left += (repaired.cylinder_N.col(i) - fast.cylinder_N.col(i)).squaredNorm();
  }
  EXPECT_LT(std::sqrt(left), 0.2 * std::sqrt(raw));
}

TEST(TorqueFit, JudgesEachJointByItself) {
  TorqueComparison comparison;
  comparison.step_s = 0.005;
  for (int i = 0; i < 2000; ++i) {
    const double s = std::sin(0.01 * i), noise = i % 2 == 0 ? 0.3 : -0.3;
    comparison.measured_Nm.emplace_back(100 * s, 10 * s, 5 + noise);
    comparison.modelled_Nm.emplace_back(100 * s + 1, 9 * s, std::numeric_limits<double>::quiet_NaN());
    comparison.usable.push_back(1);
  }
  const TorqueFit fit = torque_fit(comparison, 0);
  EXPECT_NEAR(fit.rms_Nm[0], 1, 1e-9);
  EXPECT_NEAR(fit.vaf[0], 1, 1e-9);  // an offset explains no less of what varies
  EXPECT_NEAR(fit.nrmse[1], 0.1, 0.01);
  EXPECT_NEAR(fit.vaf[1], 0.99, 0.001);
  EXPECT_TRUE(std::isnan(fit.rms_Nm[2]));
  for (JointVector& v : comparison.modelled_Nm) v[2] = 5;
  EXPECT_NEAR(torque_fit(comparison, 0).rms_Nm[2], 0.3, 1e-9);
  EXPECT_LT(torque_fit(comparison, 2).rms_Nm[2], 0.002);  // above the cut-off
  for (JointVector& v : comparison.measured_Nm) v[0] = 5;
  EXPECT_TRUE(std::isnan(torque_fit(comparison, 0).nrmse[0])) << "nothing to relate the error to";
  EXPECT_TRUE(std::isfinite(torque_fit(comparison, 0).rms_Nm[0]));
}

}  // namespace
}  // namespace knuckle::estimation
