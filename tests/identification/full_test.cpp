// The `full` method on data whose truth is known to the last digit: recovery, bias, rank, refusals.
#include "estimation/identification/full.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <random>

#include "estimation/identification/filtered_regressor.h"
#include "machine/kinematics.h"
#include "tests/identification/synthetic.h"

namespace knuckle::estimation {
namespace {

/// Covariances from residuals alone: quicker, where only parameters are judged.
FullOptions of_residuals() {
  FullOptions options;
  options.usual_errors = false;
  return options;
}

FullResult full(const MachineDescription& machine, const Recording& recording,
                const FullOptions& options = of_residuals()) {
  return identify_full(machine, std::array{recording}, options);
}

/// Gravity moments to `tolerance` of the link's own, inertias to `inertia_tolerance`.
void expect_base(const BaseParameters& found, const BaseParameters& truth, double tolerance, double inertia_tolerance) {
  for (int i = 0; i < kJoints; ++i) {
    const double moment = std::hypot(truth[kMomentX + i], truth[kMomentZ + i]);
    EXPECT_NEAR(found[kMomentX + i], truth[kMomentX + i], tolerance * moment) << "X" << i + 1;
    EXPECT_NEAR(found[kMomentZ + i], truth[kMomentZ + i], tolerance * moment) << "Z" << i + 1;
    EXPECT_NEAR(found[i], truth[i], inertia_tolerance * truth[i]) << "J" << i + 1;
  }
}

/// The method as M sets it: short window, 20 Hz, plain least squares on sgn(v).
FullOptions settings_of_m() {
  FullOptions options;
  options.motion.window_s = 0.035;
  options.motion.order = 2;
  options.regressor.pole_Hz = 20;
  options.regressor.triangle_s = 0;
  options.regressor.friction.dahl = options.regressor.friction.stribeck = options.regressor.friction.load = false;
  options.weighted = false;
  options.huber = 0;
  options.consistent = false;
  return options;
}

TEST(FilteredRegressor, ConvergesToTheFilteredInverseDynamicsWithTheSquareOfTheStep) {
  const MachineDescription machine = test_machine();
  const RigidArm arm(machine);
  const BaseParameters parameters = base_parameters(machine);
  const RichMotion path;
  RegressorOptions options;
  options.triangle_s = 0;
  // F tau by a fine step, from rest of the filter as the regressor starts.
  constexpr double kEnd_s = 4, kFine_s = 1e-4;
  FohFilter<JointVector> fine(options.pole_Hz, kFine_s);
  for (int n = 0; n <= std::lround(kEnd_s / kFine_s); ++n) {
    const SineMotion::Point p = path.at(n * kFine_s);
    const JointVector torque = inverse_dynamics(arm, parameters, p.angle, p.rate, p.acceleration, 0.01);
    if (n == 0)
      fine.start(torque);
    else
      fine.step(torque);
  }
  const auto error = [&](double step_s) {
    Motion motion;
    motion.step_s = step_s;
    const auto size = static_cast<Eigen::Index>(std::lround(kEnd_s / step_s)) + 1;
    motion.stretches = {{0, size}};
    motion.joint_rad = motion.joint_radps = Eigen::Matrix3Xd(3, size);
    motion.cylinder_m = motion.cylinder_mps = motion.cylinder_N = motion.smooth_cylinder_N =
        motion.smooth_pressure_sum_Pa = motion.lever_m = Eigen::Matrix3Xd::Zero(3, size);
    motion.hull_pitch_rad = Eigen::RowVectorXd::Constant(size, 0.01);
    for (Eigen::Index n = 0; n < size; ++n) {
      const SineMotion::Point p = path.at(static_cast<double>(n) * step_s);
      motion.joint_rad.col(n) = p.angle;
      motion.joint_radps.col(n) = p.rate;
    }
    const FilteredRegressor regressor = filtered_regressor(arm, motion, options);
    JointVector torque;
    for (int j = 0; j < kJoints; ++j)
      torque[j] = regressor.base.col(size - 1).segment<kBaseParameters>(kBaseParameters * j).dot(parameters);
    return (torque - fine.value()).norm() / fine.value().norm();
  };
  const double coarse = error(0.004), half = error(0.002), least = error(0.0005);
  EXPECT_NEAR(coarse / half, 4, 0.2);
  EXPECT_LT(least, 1e-7);
}

TEST(FrictionSignals, BristlesComeLooseWhereTheRodStandsAndAnOffsetStays) {
  Motion motion;
  motion.step_s = 0.005;
  motion.stretches = {{0, 1000}};
  motion.joint_rad = motion.cylinder_mps = Eigen::Matrix3Xd::Zero(3, 1000);
  motion.cylinder_mps.leftCols(400).setConstant(0.05);
  motion.smooth_cylinder_N = motion.smooth_pressure_sum_Pa = Eigen::Matrix3Xd::Constant(3, 1000, 1e4);
  FrictionColumns options;
  const auto state = [&](Eigen::Index n) {  // F_c 300 N either way, offset 40 N
    const Eigen::MatrixXd columns = friction_signals(motion, options).columns;
    return 340 * columns(kCoulombExtend, n) + 260 * columns(kCoulombRetract, n);
  };
  EXPECT_NEAR(state(390), 340, 0.1);
  EXPECT_NEAR(state(500), 40 + 300 * std::exp(-1.0), 5);  // half a second later
  EXPECT_NEAR(state(999), 40, 1);
  options.settle = false;
  EXPECT_NEAR(state(999), 340, 0.1);
}

TEST(Full, RecoversEveryParameterFromCleanData) {
  const MachineDescription machine = plain_machine();
  const FullResult result = full(machine, recorded(machine, RichMotion(), 60, 0.005));
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  EXPECT_EQ(result.summary.rank, kCalibrationCount);
  expect_base(result.dynamics.base(), lumped_parameters(machine), 2e-3, 1e-2);
  for (int j = 0; j < kJoints; ++j) {
    const FrictionDescription& truth = machine.cylinders[static_cast<std::size_t>(j)].friction;
    const FrictionCalibration found = result.dynamics.friction(j);
    EXPECT_NEAR(found.coulomb_extend_N, truth.coulomb_N, 0.05 * truth.coulomb_N);
    EXPECT_NEAR(found.coulomb_retract_N, truth.coulomb_N, 0.05 * truth.coulomb_N);
    EXPECT_NEAR(found.viscous_Ns_per_m, truth.viscous_Ns_per_m, 0.02 * truth.viscous_Ns_per_m);
    EXPECT_NEAR(found.load_share, 0, 5e-3);
    EXPECT_NEAR(found.seal_m2 * 1e7, 0, 0.05 * truth.coulomb_N) << "at 100 bar";
  }
}

TEST(Full, TellsFrictionOfSealsByPressureFromCoulombFriction) {
  const MachineDescription machine = plain_machine();
  SyntheticErrors errors;
  errors.seal_m2 = 1e-4;  // 3 % of the piston areas: 1 kN at 100 bar
  errors.back_swing = 0.9;
  const FullResult result = full(machine, recorded(machine, RichMotion(), 60, 0.005, errors));
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  for (int j = 0; j < kJoints; ++j) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(j)];
    CylinderFriction truth(cylinder.friction);
    truth.seal_m2 = errors.seal_m2;
    const CylinderFriction found(result.dynamics.friction(j));
    EXPECT_NEAR(found.seal_m2, truth.seal_m2, 0.25 * truth.seal_m2);
    // The parameters stand in for one another; their sum, which is what is used, must be right where the rod works.
    for (const double push_N : {5e3, 15e3}) {
      const double back_Pa = 30e5, head_Pa = (push_N + back_Pa * cylinder.rod_side_area_m2()) / cylinder.head_area_m2();
      const auto width_N = [&](const CylinderFriction& f) {  // between extending and retracting: offsets cancel
        return f.force_N(1, 0.03, push_N, head_Pa + back_Pa) - f.force_N(-1, -0.03, push_N, head_Pa + back_Pa);
      };
      EXPECT_NEAR(width_N(found), width_N(truth), 0.15 * width_N(truth)) << j;
    }
  }
}

TEST(Full, RecoversParametersWithTheSensorsOfTheMachine) {
  const MachineDescription machine = plain_machine();
  SyntheticErrors errors = real_sensors();
  errors.mass_factor = 1.04;
  errors.friction_factor = 1.2;
  const FullResult result = full(machine, recorded(machine, RichMotion(), 60, 0.005, errors));
  ASSERT_TRUE(result.summary.usable) << result.summary.reasons.front();
  // A constant force in the boom's cylinder, that is pressure offset, looks much like weight far out: X1 is the worst.
  expect_base(result.dynamics.base(), 1.04 * lumped_parameters(machine), 0.02, 0.1);
  EXPECT_LT(result.summary.condition_number, 1e3);
}

TEST(Full, WithTheSettingsOfMInertiasOfArmAndBucketComeOutFarTooSmallAtSlowMotion) {
  const MachineDescription machine = plain_machine();
  const Recording recording = recorded(machine, RichMotion(0.7), 40, 0.01, real_sensors());
  const BaseParameters truth = lumped_parameters(machine);
  const BaseParameters m = full(machine, recording, settings_of_m()).dynamics.base();
  const BaseParameters ours = full(machine, recording).dynamics.base();
  // Encoder noise in the regressor, not in the torque: errors in variables pull the inertias towards zero.
  EXPECT_LT(m[kInertia + kArm] / truth[kInertia + kArm], 0.7);
  EXPECT_LT(m[kInertia + kBucket] / truth[kInertia + kBucket], 0.7);
  EXPECT_NEAR(ours[kInertia + kArm] / truth[kInertia + kArm], 1, 0.1);
  EXPECT_NEAR(ours[kInertia + kBucket] / truth[kInertia + kBucket], 1, 0.2);
}

/// 30 s with the sensors of the machine.
const Recording& sensed() {
  static const Recording recording = recorded(plain_machine(), RichMotion(), 30, 0.01, real_sensors());
  return recording;
}

/// What the drawing's machine makes of it, with usual errors.
const FullResult& drawing() {
  static const FullResult result = full(plain_machine(), sensed(), FullOptions{});
  return result;
}

TEST(Full, AddsTheModelErrorItIsGivenToItsCovariance) {
  const FullResult without = full(plain_machine(), sensed());
  FullOptions options;  // with usual errors, which are not counted twice
  options.model_error = CalibrationMatrix(4 * CalibrationMatrix::Identity());
  const FullResult with = full(plain_machine(), sensed(), options);
  EXPECT_NEAR(with.dynamics.covariance(0, 0), without.dynamics.covariance(0, 0) + 4, 1e-9);
  EXPECT_DOUBLE_EQ(with.summary.parameters[0].sigma, std::sqrt(with.dynamics.covariance(0, 0)));
}

/// Of base parameters: errors in standard deviations.
Eigen::VectorXd normalised_errors(const FullResult& result, const BaseParameters& truth) {
  const Eigen::VectorXd error = result.dynamics.parameters.head<kBaseCount>() - truth;
  return error.cwiseQuotient(result.summary.covariance.diagonal().head<kBaseCount>().cwiseSqrt());
}

double covered(const Eigen::VectorXd& normalised) {
  return static_cast<double>((normalised.cwiseAbs().array() <= 1.96).count()) / static_cast<double>(normalised.size());
}

TEST(Full, IntervalsHoldTheTruthWhereSensorsAndLengthsAreAsFarOffAsTheyUsuallyAre) {
  const MachineDescription machine = plain_machine();
  const BaseParameters truth = lumped_parameters(machine);
  std::mt19937_64 random(20);
  std::uniform_real_distribution<double> within(-1, 1);
  Eigen::VectorXd with, without;
  for (int n = 0; n < 6; ++n) {
    std::array<double, 6> gain;
    for (double& g : gain) g = 1 + 0.005 * within(random);
    const double slope_rad = std::numbers::pi / 360 * within(random);
    const JointVector length_m = 0.5e-3 * JointVector(within(random), within(random), within(random));
    Recording recording = sensed();
    for (Measurement& m : recording.samples) {
      for (std::size_t side = 0; side < gain.size(); ++side) m.pressure_Pa[side] *= gain[side];
      m.hull_pitch_rad += slope_rad;
      m.cylinder_m += length_m;
    }
    const FullResult result = full(machine, recording, FullOptions{}), narrow = full(machine, recording);
    ASSERT_TRUE(result.summary.usable);
    EXPECT_EQ(result.summary.sigmas, Identification::Sigmas::kWithUsualErrors);
    EXPECT_EQ(narrow.summary.sigmas, Identification::Sigmas::kOfResiduals);
    EXPECT_EQ(result.dynamics.parameters, narrow.dynamics.parameters);
    EXPECT_EQ(result.dynamics.covariance, narrow.dynamics.covariance)
        << "sensors' errors cancel where they are read again";
    for (auto [all, one] : {std::pair(&with, &result), std::pair(&without, &narrow)}) {
      all->conservativeResize(all->size() + kBaseCount);
      all->tail<kBaseCount>() = normalised_errors(*one, truth);
    }
  }
  EXPECT_GE(covered(with), 0.9);
  EXPECT_LT(covered(without), 0.7);
  EXPECT_GT(with.squaredNorm() / static_cast<double>(with.size()), 0.05) << "much wider than they need to be";
}

TEST(Full, ASurveyNarrowsTheIntervals) {
  MachineDescription machine = plain_machine();
  machine.geometry_calibration.emplace();  // `machine` is as calibrated(): only that it was surveyed counts
  const FullResult surveyed = full(machine, sensed(), FullOptions{});
  for (const int k : {kMomentX + kArm, kMomentX + kBucket})
    EXPECT_LT(surveyed.summary.covariance(k, k), 0.5 * drawing().summary.covariance(k, k)) << k;
}

TEST(Full, NamesWhatItsIntervalsDoNotContain) {
  MachineDescription machine = plain_machine();
  const auto note = [](const FullResult& result) {
    for (const std::string& reason : result.summary.reasons)
      if (reason.find("do not contain") != std::string::npos) return reason;
    return std::string();
  };
  EXPECT_EQ(note(drawing()), "");
  // With its pin 1.2 mm away this cylinder would have to be shorter than it can be.
  CylinderDescription& boom = machine.cylinders[kBoom];
  boom.min_length_m = Kinematics(machine).cylinder_at(kBoom, machine.links[kBoom].min_rad)->length_m - 1e-4;
  const FullResult tight = full(machine, sensed(), FullOptions{});
  EXPECT_TRUE(tight.summary.usable);
  EXPECT_NE(note(tight).find("boom cylinder's"), std::string::npos) << note(tight);
}

TEST(Recording, DecimatedBridgesNoGapThatIsShorterThanItsStep) {
  Recording recording{"", 0.005, std::vector<Measurement>(10), std::vector<std::uint8_t>(10, 1), {}};
  recording.usable[5] = 0;
  EXPECT_EQ(decimated(recording, 4).usable, (std::vector<std::uint8_t>{1, 0, 1}));
}

TEST(Consistency, MovesAnImpossibleInertiaToTheNearestPossibleArm) {
  const MachineDescription machine = test_machine();
  const JointVector greatest_kg = greatest_mass_kg(machine);
  CalibrationVector free = CalibrationVector::Ones();
  free.head<kBaseCount>() = base_parameters(machine);
  ASSERT_TRUE(physically_consistent(free, greatest_kg));
  EXPECT_EQ(nearest_consistent(free, CalibrationMatrix::Identity(), greatest_kg), free);
  free[kInertia + kBucket] = -3;
  CalibrationMatrix information = CalibrationMatrix::Identity();
  information(2, 2) = 1e-4;  // the inertia is what the data know least of, so it is what gives
  const CalibrationVector moved = nearest_consistent(free, information, greatest_kg);
  CalibrationVector rounded = moved;
  rounded[kInertia + kBucket] += 1e-9;
  EXPECT_TRUE(physically_consistent(rounded, greatest_kg));
  EXPECT_NEAR(moved[kMomentX + kBucket], free[kMomentX + kBucket], 0.05);
  const double least = (std::pow(moved[5], 2) + std::pow(moved[8], 2)) / greatest_kg[2];
  EXPECT_NEAR(moved[kInertia + kBucket], least, 1e-4);  // on the border, no further in
}

TEST(Consistency, NoFrictionOfAnIdentifiedCylinderDrivesIt) {
  const JointVector greatest_kg = greatest_mass_kg(test_machine());
  CalibrationVector free = CalibrationVector::Ones();
  free.head<kBaseCount>() = base_parameters(test_machine());
  const auto friction = [&](FrictionIndex which) -> double& { return free[friction_index(kArm, which)]; };
  friction(kCoulombExtend) = 945;
  friction(kCoulombRetract) = -1054;  // a transmitter's error of 1 kN, and Coulomb friction of -54.5 N
  friction(kBreakaway) = 20;
  friction(kSeal) = 0.25;
  ASSERT_FALSE(physically_consistent(free, greatest_kg));
  CalibrationMatrix information = CalibrationMatrix::Identity();
  for (const bool breakaway_known : {true, false}) {
    const int breakaway = friction_index(kArm, kBreakaway);
    if (!breakaway_known) information(breakaway, breakaway) = 0;
    const CalibrationVector moved = nearest_consistent(free, information, greatest_kg);
    EXPECT_TRUE(physically_consistent(moved, greatest_kg));
    EXPECT_NEAR(moved[friction_index(kArm, kCoulombExtend)], 999.5, 1e-3);
    EXPECT_NEAR(moved[friction_index(kArm, kCoulombRetract)], -999.5, 1e-3);
    EXPECT_NEAR(moved[breakaway], 20, breakaway_known ? 1e-3 : 0);
    EXPECT_NEAR(moved[friction_index(kArm, kSeal)], 0.25, 1e-3);
    EXPECT_TRUE(moved.head<kBaseCount>().isApprox(free.head<kBaseCount>(), 1e-4));
  }
  friction(kCoulombRetract) = -905;  // mean 20 N, and static friction of -30 N
  friction(kBreakaway) = -50;
  ASSERT_FALSE(physically_consistent(free, greatest_kg));
  const CalibrationVector moved = nearest_consistent(free, CalibrationMatrix::Identity(), greatest_kg);
  EXPECT_TRUE(physically_consistent(moved, greatest_kg));
  EXPECT_GE(moved[friction_index(kArm, kBreakaway)], -45);
}

TEST(Projection, FindsTheParametersOfTorquesThatAreExactlySuchAnArm) {
  const MachineDescription machine = test_machine();
  const RigidArm arm(machine);
  const BaseParameters truth = base_parameters(machine);
  std::vector<DynamicState> states;
  for (double t = 0; t < 20; t += 0.1) {
    const SineMotion::Point p = RichMotion().at(t);
    states.push_back({p.angle, p.rate, p.acceleration, 0.02, JointVector(0.2, 0.2, 0.1),
                      inverse_dynamics(arm, truth, p.angle, p.rate, p.acceleration, 0.02)});
  }
  EXPECT_TRUE(project(machine, states).isApprox(truth, 1e-9));
  for (DynamicState& s : states) s.joint_radps = s.joint_radps2 = JointVector::Zero();
  EXPECT_THROW(static_cast<void>(project(machine, states)), std::invalid_argument);
}

}  // namespace
}  // namespace knuckle::estimation
