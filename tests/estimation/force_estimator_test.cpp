// The force estimator on synthetic machines whose every error is known: steps, alarms, end stops, bad input.
#include "estimation/force_estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "estimation/tip_force.h"
#include "tests/estimation/test_machine.h"
#include "tests/estimation/twin.h"
#include "tests/support/no_alloc.h"

namespace knuckle::estimation {
namespace {

TEST(ForceEstimator, PerfectModelFeelsNothingInFreeMotion) {
  Twin run(SyntheticErrors{});
  run.free_motion(3);
  EXPECT_LT(run.no_load_N(20), 12);
}

TEST(ForceEstimator, KnownForceStepIsRecoveredInMagnitudeDirectionAndTime) {
  Twin run(real_sensors());
  run.free_motion(25);
  const PlanarVector force(-1200, 900);
  const Kinematics kinematics(test_machine());
  double slow90_s = -1, fast90_s = -1;
  for (int n = 0; n < 200; ++n) {
    const ForceEstimate& e = run.step(force, 0.3);
    const double t = (n + 1) * kStep_s;
    const JointVector expected = kinematics.tip_jacobian(run.angle_rad).transpose() * force;
    if (slow90_s < 0 && e.tip_N.dot(force) > 0.9 * force.squaredNorm()) slow90_s = t;
    if (fast90_s < 0 && e.fast_torque_Nm.dot(expected) > 0.9 * expected.squaredNorm()) fast90_s = t;
  }
  EXPECT_GT(slow90_s, 0);
  EXPECT_LT(slow90_s, 0.22);
  EXPECT_GT(fast90_s, 0) << "never";
  EXPECT_LT(fast90_s, 0.12);
  const ForceEstimate& e = run.estimator().estimate();
  EXPECT_LT((e.tip_N - force).norm(), 0.05 * force.norm());
  EXPECT_GT(e.confidence, 0.5);
  EXPECT_TRUE(e.contact);
}

/// Known in free motion, then met by a force in which its rods come to a stop.
Twin held_by(const PlanarVector& force_N) {
  Twin twin(real_sensors());
  twin.free_motion(15);
  for (double t = 0; t < 0.5; t += kStep_s) twin.step(force_N);
  twin.hold();
  for (double speed = 1; speed > 0; speed -= kStep_s) twin.step(force_N, speed);
  return twin;
}

// In free air vibrations release the friction of a rod that stands; in a press it stays, at the side that the rod came
// from, and is some 100 N of force at the tip.
TEST(ForceEstimator, FrictionOfRodsThatStandInAPressIsNotTakenForForce) {
  for (const double way : {0.5, 2.0, 4.0, 5.5}) {
    const PlanarVector press_N = 2000 * PlanarVector(std::cos(way), std::sin(way));
    Twin twin = held_by(press_N);
    double error_N = 0;
    for (double t = 0; t < 3; t += kStep_s) error_N = (twin.step(press_N, 0).tip_N - press_N).norm();
    EXPECT_LT(error_N, 50) << way;
  }
}

// A chain that pulls at the bucket holds no rod: the arm rings on its oil by less than an encoder's step, the friction
// of its seals is released, and only the pressures show it.
TEST(ForceEstimator, FrictionThatRingingReleasesIsNotTakenOffAForce) {
  for (const double way : {0.5, 2.0, 4.0, 5.5}) {
    const PlanarVector pull_N = 2000 * PlanarVector(std::cos(way), std::sin(way));
    Twin twin = held_by(pull_N);
    for (double ring_m = 4e-5; ring_m > 0; ring_m -= 4e-5 * kStep_s) {
      twin.ring(ring_m);
      twin.step(pull_N, 0);
    }
    twin.ring(0);
    PlanarVector sum_N = PlanarVector::Zero();
    int n = 0;
    for (double t = 0; t < 1; t += kStep_s, ++n) sum_N += twin.step(pull_N, 0).tip_N - pull_N;
    EXPECT_LT((sum_N / n).norm(), 65) << way;  // taken as held: 112
  }
}

TEST(ForceEstimator, FrictionOfRodsThatCreepInAPressIsNotTakenForForce) {
  const PlanarVector press_N(-1500, 1500);
  Twin twin = held_by(press_N);
  constexpr double kCreep = 2e-3;  // of the motion's speed: some tenths of a millimetre a second
  double sum_N = 0;
  int n = 0;
  for (double t = 0; t < 8; t += kStep_s) {
    const double error_N = (twin.step(press_N, kCreep).tip_N - press_N).norm();
    if (t > 4) {
      sum_N += error_N;
      ++n;
    }
  }
  EXPECT_LT(sum_N / n, 50);
}

TEST(ForceEstimator, HullThatTiltsIsNoForce) {
  Twin run(real_sensors());
  run.free_motion(25);
  const double level_N = run.no_load_N(10);
  for (int n = 0; n < 1000; ++n) {  // 7 deg in 5 s: a track sinks in
    run.hull_pitch_rad = 0.12 * n / 1000;
    run.step(PlanarVector::Zero());
  }
  EXPECT_LT(run.no_load_N(2), level_N + 20) << "before the bias filter could learn it";
}

TEST(ForceEstimator, CovarianceCoversTheErrorOfAMistakenModel) {
  int covered = 0, all = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SyntheticErrors e = real_sensors();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> part(-1, 1);
    e.bias_N = 350 * JointVector(part(random), part(random), part(random));
    e.friction_factor = 1 + 0.3 * part(random);
    e.mass_factor = 1 + 0.05 * part(random);
    Twin run(e, seed);
    for (int n = 0; n < 8000; ++n) {
      const ForceEstimate& f = run.step(PlanarVector::Zero());
      if (n < 200 || n % 20 != 0) continue;
      ++all;
      if (f.tip_N.dot(f.covariance_N2.inverse() * f.tip_N) < 5.99) ++covered;  // 95 % of chi^2 with 2
    }
  }
  EXPECT_GT(covered, 0.9 * all);
}

// A rod at rest may hide as much as its seals hold, which no drawing says.
TEST(ForceEstimator, DoubtsARodAtRestByTheFrictionThatWasFound) {
  SyntheticErrors sealed = real_sensors();
  sealed.seal_m2 = 6e-5;
  sealed.back_swing = 0.9;
  Twin run(sealed);
  run.free_motion(60);
  run.stop();
  const ForceEstimate& e = run.estimator().estimate();
  const MachineDescription machine = test_machine();
  for (int i = 0; i < kJoints; ++i) {
    const double nominal_N = CylinderFriction(machine.cylinders[static_cast<std::size_t>(i)].friction).static_N();
    const double seals_N = run.estimator().learned().state()[kBiasSeal + i] * 40e5;  // there is more in every cylinder
    EXPECT_GT(std::sqrt(e.measurement_variance_Nm2[i]), 0.5 * (nominal_N + seals_N) * std::abs(e.lever_m[i])) << i;
  }
}

/// Steel takes torque of one joint; the tip force must come from the two others, or not be believed.
TEST(ForceEstimator, EndStopIsNoForceOfTheWorld) {
  for (int joint = 0; joint < kJoints; ++joint) {
    MachineDescription machine = test_machine();
    const auto i = static_cast<std::size_t>(joint);
    const double extended_rad = joint == kBoom ? machine.links[i].max_rad : machine.links[i].min_rad;
    machine.cylinders[i].max_length_m = Kinematics(machine).cylinder_at(joint, extended_rad)->length_m + 1e-3;
    Twin run(real_sensors(), 1, machine);
    run.motion.amplitude_rad[joint] = 0;
    run.motion.middle_rad[joint] = extended_rad;
    for (double t = 0; t < 1; t += kStep_s) run.step(PlanarVector::Zero(), 0);
    JointVector stop = JointVector::Zero();
    stop[joint] = 500;
    for (double t = 0; t < 1; t += kStep_s) run.step(PlanarVector::Zero(), 0, stop);
    const ForceEstimate& e = run.estimator().estimate();
    EXPECT_TRUE(e.confidence_reasons & kEndStop) << "joint " << joint;
    EXPECT_LT(e.tip_N.norm() * e.confidence, 150) << "joint " << joint << ": " << e.tip_N.transpose();
  }
}

/// Where the bucket's lever is 2 cm, pins that are 2 mm off put its stop a tenth of a radian from where the drawing has
/// it.
TEST(ForceEstimator, AStopIsKnownAsFarOffAsPinsOfADrawingMayPutIt) {
  const MachineDescription machine = test_machine();
  const double short_of_end_rad = machine.links[kBucket].min_rad + 0.1;
  ASSERT_LT(std::abs(Kinematics(machine).cylinder_at(kBucket, short_of_end_rad)->lever_m), 0.03);
  Twin run(real_sensors(), 1, machine);
  run.motion.amplitude_rad[kBucket] = 0;
  run.motion.middle_rad[kBucket] = short_of_end_rad;
  for (double t = 0; t < 12; t += kStep_s) run.step(PlanarVector::Zero(), 0);
  ASSERT_FALSE(run.estimator().estimate().contact);
  const JointVector steel(0, 0, 1000);  // of a cylinder that presses with all its pressure
  for (double t = 0; t < 3; t += kStep_s) {
    run.step(PlanarVector::Zero(), 0, steel);
    ASSERT_FALSE(run.estimator().estimate().contact) << "after " << t << " s";
  }
  EXPECT_TRUE(run.estimator().estimate().confidence_reasons & kEndStop);
}

TEST(ForceEstimator, CalibratedMachineIsGoodBeforeAnyBiasIsLearned) {
  SyntheticErrors errors = oil_of_today();
  errors.viscosity_factor = 1;
  Twin drawn(errors), calibrated(errors, 1, calibrated_twin(errors, 10));
  drawn.free_motion(0.6);  // the twin starts in full motion, the estimator at rest
  calibrated.free_motion(0.6);
  const double drawn_N = drawn.no_load_N(1.4), calibrated_N = calibrated.no_load_N(1.4);
  EXPECT_GT(drawn_N, 100);
  EXPECT_LT(calibrated_N, 30);
}

TEST(ForceEstimator, OpenReliefWidensItsJointAlone) {
  MachineDescription machine = test_machine();
  machine.hydraulics.hose_drop_Pa_per_m3ps = 3e8;
  machine.hydraulics.pump_flow_m3ps = 5e-4;
  ForceEstimator estimator(machine, kStep_s);
  JointState state;
  state.angle_rad = JointVector(0.3, -1.5, -0.9);
  state.lever_m = JointVector(0.2, -0.2, -0.1);
  state.pressure_Pa.fill(50e5);
  estimator.step(state);  // what grows with the force is that of the last step's
  const Eigen::Matrix3d before = estimator.step(state).joint_covariance_Nm2;
  state.pressure_Pa[2] = 204e5;
  const ForceEstimate& open = estimator.step(state);
  EXPECT_TRUE(open.confidence_reasons & kReliefOpen);
  const double hidden_Nm = 0.2 * 1.5e5 * machine.cylinders[kArm].head_area_m2();
  EXPECT_NEAR(open.joint_covariance_Nm2(1, 1) - before(1, 1), hidden_Nm * hidden_Nm, 0.2 * hidden_Nm * hidden_Nm);
  EXPECT_NEAR(open.joint_covariance_Nm2(0, 0), before(0, 0), 0.1 * before(0, 0));
}

TEST(ForceEstimator, PinsAsDrawnMakeALargeForceLessCertainThanCalibratedOnes) {
  MachineDescription measured = test_machine();
  measured.geometry_calibration.emplace();
  const PlanarVector force(-3000, 1000);
  const auto sigma_N = [&](const MachineDescription& machine) {
    Twin run(real_sensors(), 1, machine);
    run.free_motion(20);
    for (double t = 0; t < 1; t += kStep_s) run.step(force, 0.3);
    return std::sqrt(run.estimator().estimate().covariance_N2.trace());
  };
  const double drawn = sigma_N(test_machine()), calibrated = sigma_N(measured);
  EXPECT_GT(drawn, 1.5 * calibrated);
  EXPECT_LT(drawn, 0.1 * force.norm());
}

TEST(Contact, NoFalseAlarmInTenMinutesOfNoise) {
  Twin run(oil_of_today());
  run.free_motion(30);
  int alarms = 0;
  bool last = false;
  for (double t = 0; t < 600; t += kStep_s) {
    const bool contact = run.step(PlanarVector::Zero()).contact;
    if (contact && !last) ++alarms;
    last = contact;
  }
  EXPECT_EQ(alarms, 0);
}

TEST(Contact, FiveHundredNewtonStepIsSeenWithinATenthOfASecond) {
  Twin run(oil_of_today());
  run.free_motion(40);
  int n = 0;
  while (!run.step({-400, 300}).contact && n < 100) ++n;
  EXPECT_LE(n * kStep_s, 0.1);
  run.free_motion(3);
  EXPECT_FALSE(run.estimator().estimate().contact);
}

/// Masses more than drawn, of which gravity has been learned, and an arm that swings by up to 0.08 rad.
class HeavySwing {
 public:
  HeavySwing(double mass_factor, double free_s) : run_(heavy(mass_factor)) {
    run_.estimator().expect_free_motion(true);
    run_.free_motion(60);
    run_.estimator().expect_free_motion(false);
    run_.free_motion(free_s);
  }
  /// @param phase_rad pi / 2: it swings most. @param phase_radps 0: so it stays.
  const ForceEstimate& step(double phase_rad, double phase_radps, const PlanarVector& tip_N = PlanarVector::Zero()) {
    run_.motion.grow_swing(JointVector(0.08, 0.03, 0.03), phase_rad, phase_radps);
    return run_.step(tip_N);
  }

 private:
  static SyntheticErrors heavy(double mass_factor) {
    SyntheticErrors e = real_sensors();
    e.mass_factor = mass_factor;
    e.lag_s.fill(kUsualLag_s);
    return e;
  }
  Twin run_;
};

// An eighth of the torque that accelerates masses is what hull and steel make of a hard swing near their own
// frequencies. The longer free motion lasts, the less of it is left to chance.
TEST(Contact, MassesThatAreNotKnownAreNoneWhenTheySwingHoweverLongMotionWasFree) {
  constexpr double kGrowth_radps = 0.2 * std::numbers::pi;
  for (const double mass_factor : {1.12, 1.2}) {
    for (const double free_s : {5, 30, 120}) {
      HeavySwing run(mass_factor, free_s);
      for (double phase = 0; phase < std::numbers::pi; phase += kGrowth_radps * kStep_s)
        ASSERT_FALSE(run.step(phase, kGrowth_radps).contact) << mass_factor << ", " << free_s << " s, at " << phase;
    }
  }
}

TEST(Contact, APushIsSeenInASwing) {
  constexpr double kGrowth_radps = 0.25 * std::numbers::pi, kMost_rad = std::numbers::pi / 2;
  HeavySwing run(1.12, 5);
  for (double phase = 0; phase < kMost_rad; phase += kGrowth_radps * kStep_s) run.step(phase, kGrowth_radps);
  ASSERT_FALSE(run.step(kMost_rad, 0).contact);
  int n = 0;
  while (!run.step(kMost_rad, 0, {-2400, 1800}).contact && n < 100) ++n;
  EXPECT_LE(n * kStep_s, 0.05);
}

TEST(TipForce, StraightArmGivesAFiniteAnswerThatAdmitsIgnorance) {
  const Kinematics kinematics(test_machine());
  const JointVector straight(0.2, 0, 0);
  const JointVector torque = kinematics.tip_jacobian(straight).transpose() * PlanarVector(500, 500);
  const TipForce tip = solve_tip_force(kinematics.tip_jacobian(straight), torque, 900 * Eigen::Matrix3d::Identity());
  EXPECT_TRUE(tip.force_N.allFinite());
  const PlanarVector along(std::cos(0.2), std::sin(0.2));
  EXPECT_GT(std::sqrt(along.dot(tip.covariance_N2 * along)), 5e3);
  const PlanarVector across(-along.y(), along.x());
  EXPECT_NEAR(tip.force_N.dot(across), across.dot(PlanarVector(500, 500)), 5);
}

TEST(TipForce, TorquesThatNoTipForceExplainsLeaveAResidual) {
  // A hit on the boom turns the boom alone.
  const auto bent = Kinematics(test_machine()).tip_jacobian({0.3, -1.5, -0.9});
  EXPECT_GT(solve_tip_force(bent, {1500, 0, 0}, 400 * Eigen::Matrix3d::Identity()).residual_sigma, 4);
}

TEST(ForceEstimator, NonFiniteInputRepeatsTheLastEstimateWithoutConfidence) {
  Twin run(real_sensors());
  run.free_motion(2);
  JointState bad;
  bad.angle_rad = run.angle_rad;
  bad.lever_m = JointVector(0.2, -0.2, -0.1);
  bad.cylinder_N = JointVector(0, std::numeric_limits<double>::quiet_NaN(), 0);
  const PlanarVector last = run.estimator().estimate().tip_N;
  const ForceEstimate& e = run.estimator().step(bad);
  EXPECT_EQ(e.tip_N, last);
  EXPECT_EQ(e.confidence, 0);
  EXPECT_TRUE(e.confidence_reasons & kBadInput);
  EXPECT_LT(run.free_motion(0.5).tip_N.norm(), 500);
  EXPECT_GT(run.estimator().estimate().confidence, 0.5);
}

TEST(ForceEstimator, PoseThatMovedWhileTheSensorsWereAwayIsNoForceAndTheBiasStays) {
  Twin run(oil_of_today());
  run.free_motion(30);
  run.stop();
  const JointVector before_rad = run.angle_rad;
  const BiasVector learned = run.estimator().learned().state();
  run.gap(1.5);
  double most_N = 0;
  for (double t = 0; t < 1; t += kStep_s) {
    most_N = std::max(most_N, run.step(PlanarVector::Zero(), 0).tip_N.norm());
    EXPECT_FALSE(run.estimator().estimate().contact) << t;
  }
  EXPECT_GT((run.angle_rad - before_rad).norm(), 0.1);
  EXPECT_LT(most_N, 400) << "no more than friction hides at rest";
  EXPECT_EQ((run.estimator().learned().state() - learned).norm(), 0);
  EXPECT_FALSE(run.estimator().estimate().confidence_reasons & kBiasNotLearned);
}

TEST(ForceEstimator, StepAllocatesNothing) {
  ForceEstimator estimator(test_machine(), kStep_s);
  JointState state;
  state.angle_rad = JointVector(0.3, -1.5, -0.9);
  state.lever_m = JointVector(0.2, -0.2, -0.1);
  const test::NoAllocScope guard;
  for (int n = 0; n < 1000; ++n) estimator.step(state);
  EXPECT_EQ(guard.allocations(), 0u);
}

}  // namespace
}  // namespace knuckle::estimation
