// Driving the simulated machine through its wires along given motions, and what is recorded of it.
#include "app/motion/machine_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "estimation/identification/paper_motions.h"
#include "estimation/identification/static_poses.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"

namespace knuckle::motion {
namespace {

const JointVector kStarts_rad(0.3, -1.5, -0.9);

/// All joints to and fro about the start, from rest to rest.
estimation::JointPath wave(double duration_s) {
  estimation::JointPath path{0.01, {}};
  for (int i = 0; i < static_cast<int>(duration_s / path.step_s); ++i) {
    const double t = i * path.step_s, fade = std::min(1.0, std::min(t, duration_s - t) / 2);
    path.joint_rad.push_back(
        kStarts_rad + fade * JointVector(0.2 * std::sin(0.6 * t), 0.3 * std::sin(0.8 * t), 0.4 * std::sin(1.1 * t)));
  }
  return path;
}

MachineRecording recorded(std::uint64_t seed) {
  MachineRun run(test::solar(), sim::sample_truth(test::solar(), seed), {}, kStarts_rad, seed);
  return run.follow(wave(8));
}

TEST(MachineRun, FollowsThePathWithinAFewDegreesAndRecordsOneOfEverythingASample) {
  const estimation::JointPath path = wave(8);
  const MachineRecording made = recorded(1);
  ASSERT_EQ(made.recording.samples.size(), 1600u);  // the path's 800, at the slave's rate
  EXPECT_DOUBLE_EQ(made.recording.step_s, 0.005);
  EXPECT_EQ(made.recording.usable, std::vector<std::uint8_t>(1600, 1));
  EXPECT_EQ(made.recording.valve.size(), 1600u);
  ASSERT_EQ(made.truth.size(), 1600u);
  double opened = 0;
  for (const JointVector& command : made.recording.valve) opened = std::max(opened, command.cwiseAbs().maxCoeff());
  EXPECT_GT(opened, test::solar().cylinders[kBoom].valve.dead_band_extend);
  JointVector worst = JointVector::Zero(), span = JointVector::Zero();
  for (std::size_t i = 0; i < made.truth.size(); ++i) {
    worst = worst.cwiseMax((made.truth[i].joint_rad - path.joint_rad[i / 2]).cwiseAbs());
    span = span.cwiseMax((made.truth[i].joint_rad - kStarts_rad).cwiseAbs());
  }
  EXPECT_LT(worst.maxCoeff(), 3 * std::numbers::pi / 180) << worst.transpose();
  EXPECT_GT(span.minCoeff(), 0.15);
}

/// With its arm stretched out a big machine swings on its oil by millimetres for seconds after its valves have closed.
TEST(MachineRun, StopsAreRestsAlsoOfABigMachineWithItsArmStretchedOut) {
  const MachineDescription big = load_machine(test::source_dir() + "/config/machines/compact080.toml");
  const std::vector<JointVector> all = estimation::static_poses(big, 170, 1);
  const std::vector<JointVector> stretched{all[10], all[11], all[13], all[14]};
  MachineRun run(big, sim::sample_truth(big, 1), {}, stretched.front(), 1);
  const MachineRecording made = run.stops(stretched, 0.8);
  int near_stops = 0;
  EXPECT_EQ(resting_poses(big, made.recording, {}, near_stops).size() + static_cast<std::size_t>(near_stops), 4U);
}

TEST(MachineRun, RecordsRawReadingsOfTheMomentOfTheirTruth) {
  // Offsets of a few millimetres, known to the controller or not, are in the readings.
  MachineDescription known = test::solar();
  sim::MachineTruth truth = sim::nominal_truth(test::solar());
  truth.encoder_offset_m = JointVector(2e-3, -1e-3, 1.5e-3);
  known.sensors.encoder_offset_m = truth.encoder_offset_m;
  const Kinematics kinematics(test::solar());
  for (const MachineDescription& seen : {test::solar(), known}) {
    MachineRun run(seen, truth, {}, kStarts_rad, 4);
    const MachineRecording made = run.follow(wave(4));
    double worst = 0;
    for (std::size_t i = 0; i < made.truth.size(); ++i) {
      for (int j = 0; j < kJoints; ++j) {
        const double length = kinematics.cylinder_at(j, made.truth[i].joint_rad[j]).value().length_m;
        const double error = made.recording.samples[i].cylinder_m[j] - length - truth.encoder_offset_m[j];
        worst = std::max(worst, std::abs(error));
      }
    }
    EXPECT_LT(worst, 0.51 * test::solar().sensors.encoder_step_m);  // no lag: half a step of the encoder
  }
}

TEST(MachineRun, OfAMachineWithoutNodesKnowsTheTruthOfEachSample) {
  const MachineDescription machine = load_machine(find_config("machine", "standard200"));
  MachineRun run(machine, sim::nominal_truth(machine), {}, kStarts_rad, 1);
  const MachineRecording made = run.follow(wave(4));
  const Kinematics kinematics(machine);
  double moved_rad = 0;
  for (std::size_t i = 0; i < made.truth.size(); ++i) {
    moved_rad = std::max(moved_rad, (made.truth[i].joint_rad - made.truth[0].joint_rad).cwiseAbs().maxCoeff());
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto at = kinematics.cylinder_at(joint, made.truth[i].joint_rad[joint]);
      ASSERT_TRUE(at) << i;
      EXPECT_NEAR(made.recording.samples[i].cylinder_m[joint], at->length_m, 0.01) << i << ", joint " << joint;
    }
  }
  EXPECT_GT(moved_rad, 0.1);
}

TEST(MachineRun, IsAFunctionOfItsSeed) {
  const MachineRecording first = recorded(3), again = recorded(3), other = recorded(4);
  bool same = true, differs = false;
  for (std::size_t i = 0; i < first.recording.samples.size(); ++i) {
    same = same && first.recording.samples[i].pressure_Pa == again.recording.samples[i].pressure_Pa &&
           first.truth[i].joint_rad == again.truth[i].joint_rad;
    differs = differs || first.recording.samples[i].pressure_Pa != other.recording.samples[i].pressure_Pa;
  }
  EXPECT_TRUE(same);
  EXPECT_TRUE(differs);
}

TEST(MachineRun, StopsAtEachPoseAtRest) {
  MachineRun run(test::solar(), sim::sample_truth(test::solar(), 5), {}, kStarts_rad, 5);
  const std::vector<JointVector> poses{{0.5, -1.2, -1.2}, {0.2, -1.8, -0.6}};
  const MachineRecording made = run.stops(poses, 0.5);
  ASSERT_EQ(made.recording.samples.size(), 100u + 1 + 100);
  EXPECT_EQ(made.recording.usable[100], 0);
  for (std::size_t i = 0; i < made.truth.size(); ++i) {
    if (i == 100) continue;
    EXPECT_EQ(made.recording.usable[i], 1);
    EXPECT_LT(made.truth[i].joint_radps.norm(), 0.01) << i;
    EXPECT_LT((made.truth[i].joint_rad - poses[i / 101]).cwiseAbs().maxCoeff(), 0.05) << i;
    EXPECT_EQ(made.recording.valve[i], JointVector::Zero());
  }
}

TEST(MachineRun, SurveysTheTrueJointsWithTheErrorsAskedFor) {
  const sim::MachineTruth truth = sim::nominal_truth(test::solar());
  MachineRun run(test::solar(), truth, {}, kStarts_rad, 6);
  const Kinematics kinematics(test::solar());
  for (const double sigma_m : {0.0, 0.01}) {
    const estimation::Survey survey = run.survey({{0.5, -1.2, -1.2}}, sigma_m);
    ASSERT_EQ(survey.poses.size(), 1u);
    EXPECT_EQ(survey.point_sigma_m, sigma_m);
    JointVector angle;
    for (int j = 0; j < kJoints; ++j) angle[j] = kinematics.joint_at(j, survey.poses[0].cylinder_m[j]).value();
    const double tip_error = (survey.poses[0].tip_m - kinematics.tip(angle)).norm();
    const double link_error =
        (survey.poses[0].bucket_pin_m - survey.poses[0].arm_pin_m).norm() - test::solar().links[kArm].length_m;
    EXPECT_LT(tip_error, 2e-3 + 4 * sigma_m);
    EXPECT_LT(std::abs(link_error), 1e-9 + 4 * sigma_m);
    EXPECT_EQ(std::abs(link_error) > 1e-5, sigma_m > 0);
  }
}

TEST(MachineRun, TestRigPullsAndLetsGo) {
  MachineRun run(test::solar(), sim::nominal_truth(test::solar()), {}, kStarts_rad, 7);
  estimation::JointPath hold{0.01, std::vector<JointVector>(200, kStarts_rad)};
  std::vector<PlanarVector> pull(200, PlanarVector(0, -800));
  for (std::size_t i = 0; i < 100; ++i) pull[i] *= static_cast<double>(i) / 100;
  const MachineRecording made = run.follow(hold, pull);
  for (std::size_t i = 0; i < made.truth.size(); ++i) {
    EXPECT_NEAR(made.truth[i].contact_N.y(), pull[i / 2].y(), 12) << i;  // a sample is some milliseconds old
  }
  const auto boom_head = [](const MachineRecording& r, std::size_t i) { return r.recording.samples[i].pressure_Pa[0]; };
  EXPECT_GT(boom_head(made, 399), boom_head(made, 0) + 5e5);
  EXPECT_EQ(run.rest(0.1).truth.front().contact_N.norm(), 0);
  EXPECT_THROW((void)run.follow(hold, {PlanarVector::Zero()}), std::invalid_argument);
}

TEST(MachineRun, TellsWhatTheSlaveLoopReportsOfEachSample) {
  MachineRun run(test::solar(), sim::nominal_truth(test::solar()), {}, kStarts_rad, 9);
  std::vector<slave::SlaveState> told;
  std::vector<PlanarVector> truth_N;
  run.listen([&](const slave::SlaveState& state, const TruthSample& truth) {
    told.push_back(state);
    truth_N.push_back(truth.contact_N);
  });
  // Half a metre beside the tip, at the bucket's pin, which turns no bucket joint.
  estimation::JointPath hold{0.01, std::vector<JointVector>(300, kStarts_rad)};
  const MachineRecording made = run.follow(hold, std::vector<PlanarVector>(300, PlanarVector(0, -2000)),
                                           {-test::solar().links[kBucket].length_m, 0});
  ASSERT_EQ(told.size(), made.recording.samples.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told[i].pressure_Pa, made.recording.samples[i].pressure_Pa) << i;
    EXPECT_EQ(truth_N[i], made.truth[i].contact_N) << i;
  }
  EXPECT_EQ(told.back().mode, Mode::kEngaged);
  EXPECT_NEAR(told.back().torque_Nm[kBucket], 0, 60);
  EXPECT_LT(told.back().torque_Nm[kArm], -300);
}

TEST(MachineRun, WeightHangsUntilItIsTakenOff) {
  MachineRun run(test::solar(), sim::nominal_truth(test::solar()), {}, kStarts_rad, 8);
  const double before = run.rest(0.1).recording.samples.back().pressure_Pa[0];
  run.hang(100);
  const MachineRecording hung = run.rest(0.1);
  EXPECT_DOUBLE_EQ(hung.truth.front().payload_kg, 100);
  EXPECT_GT(hung.recording.samples.back().pressure_Pa[0], before + 10e5);
  run.hang(0);
  EXPECT_DOUBLE_EQ(run.rest(0.1).truth.front().payload_kg, 0);
}

}  // namespace
}  // namespace knuckle::motion
