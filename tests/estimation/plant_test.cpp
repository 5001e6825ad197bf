// What the estimator reaches on the simulated hydraulic machine with drawn truths: no-load force, press, weighing.
#include <gtest/gtest.h>

#include "tests/estimation/plant_rig.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

constexpr double kWeightOn_s = 47.5;  // in the weighing story; the others are over by then

class OnTheMachine : public ::testing::TestWithParam<unsigned> {
 protected:
  static sim::WorldDescription world() {
    sim::WorldDescription world;
    sim::WallDescription wall;
    wall.point_m = PlanarVector(2.35, 0);
    wall.stiffness_N_per_m = 1e6;
    world.walls.push_back(wall);
    sim::DeadWeightDescription weight;
    weight.mass_kg = 50;
    weight.point_m = PlanarVector(0.3, 0.15);
    weight.attach_at_s = kWeightOn_s;
    world.weights.push_back(weight);
    return world;
  }
  OnTheMachine() {
    motion_.middle_rad = JointVector(0.5, -1.9, -1.0);
    motion_.omega_radps *= 0.5;
  }
  /// RMS of the tip force while the free motion runs at `speed` times its clock.
  double free_motion_N(double seconds, double speed) {
    double sum = 0;
    int n = 0;
    for (double t = 0; t < seconds; t += kStep_s, ++n) {
      phase_s_ += kStep_s * speed;
      const SineMotion::Point p = motion_.at(phase_s_);
      sum += rig_.follow(p.angle, p.rate * speed).tip_N.squaredNorm();
    }
    return std::sqrt(sum / n);
  }
  void move_to(const JointVector& goal_rad, double seconds) {
    const JointVector from = rig_.state().angle_rad;
    for (double t = 0; t < seconds; t += kStep_s)
      rig_.follow(from + (goal_rad - from) * (t / seconds), (goal_rad - from) / seconds);
  }

  MachineDescription nominal_ = load_machine(find_config("machine", "solar015"));
  SineMotion motion_;
  PlantRig rig_{nominal_, sim::sample_truth(nominal_, GetParam()), world(), JointVector(0.5, -1.9, -1.0), GetParam()};
  double phase_s_ = 0;
};

TEST_P(OnTheMachine, FreeMotionShowsLittleForceOnceTheBiasIsLearned) {
  free_motion_N(25, 1);
  EXPECT_FALSE(rig_.estimator().estimate().confidence_reasons & kBiasNotLearned);
  const double slow_N = free_motion_N(10, 1);
  free_motion_N(2, 2.5);
  const double digging_N = free_motion_N(10, 2.5);
  RecordProperty("slow_N", std::to_string(slow_N));
  RecordProperty("digging_N", std::to_string(digging_N));
  EXPECT_LT(slow_N, 30);
  EXPECT_LT(digging_N, 45);
  EXPECT_GT(slow_N, 2) << "too good: does the truth still differ from the file?";
}

TEST_P(OnTheMachine, PressOfTwoKilonewtonsIsKnownWithinTenPercent) {
  free_motion_N(25, 1);
  const double bucket = -0.7, height = 0.2;  // the tip is the foremost part of the bucket
  double reach = 2.2;
  move_to(*rig_.kinematics().inverse({reach, height}, bucket), 5);
  double touched_s = -1, seen_s = -1;
  int early = 0;
  while (rig_.truth().wall_N.norm() < 2000 && reach < 2.7) {
    reach += 0.05 * kStep_s;
    const ForceEstimate& e = rig_.follow(*rig_.kinematics().inverse({reach, height}, bucket), JointVector::Zero());
    if (touched_s < 0 && rig_.truth().wall_N.norm() > 0) touched_s = rig_.time_s();
    if (touched_s < 0 && e.contact) ++early;
    if (touched_s >= 0 && seen_s < 0 && e.contact) seen_s = rig_.time_s();
  }
  for (double t = 0; t < 1; t += kStep_s) rig_.hold();
  PlanarVector estimated = PlanarVector::Zero(), truth = PlanarVector::Zero();
  for (double t = 0; t < 2; t += kStep_s) {
    estimated += rig_.hold().tip_N;
    truth += rig_.truth().wall_N;
  }
  EXPECT_GT(truth.norm() * kStep_s / 2, 1500);
  EXPECT_LT((estimated - truth).norm(), 0.1 * truth.norm());
  EXPECT_LT(std::abs(std::acos(estimated.normalized().dot(truth.normalized()))), 0.05);
  EXPECT_EQ(early, 0);
  EXPECT_GE(seen_s, touched_s);
  EXPECT_LT(seen_s - touched_s, 0.15);
  EXPECT_GT(rig_.estimator().estimate().confidence, 0.5);
}

TEST_P(OnTheMachine, FiftyKilogramsInTheBucketAreWeighedWithinFive) {
  free_motion_N(kWeightOn_s - 1, 1);
  EXPECT_TRUE(rig_.payload().zero());
  free_motion_N(3, 1);
  EXPECT_EQ(rig_.truth().payload_kg, 50);
  rig_.payload().start();
  free_motion_N(12, 1);
  EXPECT_NEAR(rig_.payload().kg(), 50, 5);
  EXPECT_NEAR(rig_.payload().kg(), 50, 3 * rig_.payload().sigma_kg());
  EXPECT_LT(rig_.payload().sigma_kg(), 2.5);
}

/// A machine whose steel and ground yield, in free air: of half of the way that its tip swings no encoder sees
/// anything.
class CompliantMachine : public ::testing::Test {
 protected:
  static sim::MachineTruth truth(const MachineDescription& nominal) {
    sim::MachineTruth truth = sim::nominal_truth(nominal);
    truth.hull = sim::hull_on_tracks(nominal, 1300, 1.2, 6e6, 0.1);
    constexpr PerJoint<double> kPin_N_per_m{1.7e8, 5e7, 5e7};
    for (std::size_t i = 0; i < kJoints; ++i) truth.pin[i] = sim::compliant_pin(kPin_N_per_m[i], 1e-4, 15);
    return truth;
  }
  /// The boom goes up and down by jerks, with the arm stretched out.
  void jerk(double seconds) {
    for (double t = 0; t < seconds; t += kStep_s) {
      clock_s_ += kStep_s;
      const bool up = std::fmod(clock_s_, 2.4) < 1.2;
      const double part = std::fmod(clock_s_, 1.2) / 1.2;
      JointVector angle(0.3 + 0.084 * (up ? part : 1 - part), -1.5, -0.5), rate(up ? 0.07 : -0.07, 0, 0);
      angle[kBucket] += 0.3 * std::sin(0.7 * clock_s_);
      rate[kBucket] = 0.21 * std::cos(0.7 * clock_s_);
      const ForceEstimate& e = rig_.follow(angle, rate);
      if (e.confidence > 0.5) largest_N_ = std::max(largest_N_, e.tip_N.norm());
      contact_s_ += e.contact ? kStep_s : 0;
    }
  }
  MachineDescription nominal_ = load_machine(find_config("machine", "solar015"));
  PlantRig rig_{nominal_, truth(nominal_), {}, JointVector(0.3, -1.5, -0.5), 1};
  double clock_s_ = 0, largest_N_ = 0, contact_s_ = 0;
};

TEST_F(CompliantMachine, SwingThatNoEncoderSeesIsNoForce) {
  jerk(40);
  largest_N_ = contact_s_ = 0;
  jerk(20);
  RecordProperty("largest_N", std::to_string(largest_N_));
  RecordProperty("contact_s", std::to_string(contact_s_));
  EXPECT_LT(largest_N_, 120);
  EXPECT_EQ(contact_s_, 0);
}

INSTANTIATE_TEST_SUITE_P(DrawnTruths, OnTheMachine, ::testing::Range(1U, 6U));

}  // namespace
}  // namespace knuckle::estimation
