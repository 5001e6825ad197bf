// Dirty data: a good recording passes untouched; every defect put into it is named by column and row, or refused.
#include "app/identify/data_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "estimation/identification/excitation.h"
#include "machine/load.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/refusal.h"

namespace knuckle::identify {
namespace {

using estimation::Measurement;
using estimation::Recording;

std::size_t unusable(const Recording& recording) {
  return static_cast<std::size_t>(std::count(recording.usable.begin(), recording.usable.end(), std::uint8_t{0}));
}

/// What is said of a recording; "accepted" where it is not refused.
std::string refusal(const MachineDescription& machine, recordings::RecordedFile file) {
  return test::refusal([&] { (void)require_data(machine, file); });
}

/// What is said of the recording after `spoil`.
std::string refusal(const std::function<void(Measurement&)>& spoil) {
  recordings::RecordedFile file = as_file(recorded_motion());
  for (Measurement& m : file.recording.samples) spoil(m);
  return refusal(test::solar(), file);
}

bool names(const std::string& text, const std::vector<std::string>& words) {
  return std::all_of(words.begin(), words.end(),
                     [&](const std::string& w) { return text.find(w) != std::string::npos; });
}

TEST(DataCheck, LeavesAGoodRecordingAsItIs) {
  recordings::RecordedFile file = as_file(recorded_motion());
  const DataCheck check = require_data(test::solar(), file);
  EXPECT_TRUE(check.findings.empty()) << check.lines().front();
  EXPECT_TRUE(check.contact.empty()) << contact_text(check.contact, file.recording);
  EXPECT_EQ(unusable(file.recording), unusable(recorded_motion()));
  for (std::size_t i = 0; i < file.recording.samples.size(); ++i)
    for (std::size_t c = 0; c < recordings::kSignalChannels; ++c)
      ASSERT_EQ(recordings::signal(file.recording.samples[i], c), recordings::signal(recorded_motion().samples[i], c))
          << i << " " << c;
  for (int j = 0; j < kJoints; ++j) EXPECT_NEAR(check.weight_ratio[j], 1, 0.5) << j;
}

/// Soil that pushes at the tip while the arm moves, as in a cycle of digging.
void push(recordings::RecordedFile& file, double from_s, double to_s, const PlanarVector& force_N) {
  const MachineDescription& machine = test::solar();
  const Kinematics kinematics(machine);
  for (std::size_t i = 0; i < file.recording.samples.size(); ++i) {
    const double t_s = file.recording.step_s * static_cast<double>(i);
    if (t_s < from_s || t_s >= to_s) continue;
    Measurement& m = file.recording.samples[i];
    JointVector angle;
    for (int j = 0; j < kJoints; ++j) angle[j] = kinematics.joint_at(j, m.cylinder_m[j]).value_or(0);
    const JointVector torque_Nm = kinematics.tip_jacobian(angle).transpose() * force_N;
    for (int j = 0; j < kJoints; ++j) {
      const auto joint = static_cast<std::size_t>(j);
      const double force = -torque_Nm[j] / kinematics.cylinder_at(j, angle[j])->lever_m;
      if (force > 0) m.pressure_Pa[2 * joint] += force / machine.cylinders[joint].head_area_m2();
      if (force < 0) m.pressure_Pa[2 * joint + 1] -= force / machine.cylinders[joint].rod_side_area_m2();
    }
  }
}

TEST(DataCheck, ARecordingThatTouchedSoilIsToldWhenAndNotThatItsChannelsAreWrong) {
  recordings::RecordedFile file = as_file(recorded_motion());
  const double length_s = file.recording.duration_s();
  ASSERT_GE(length_s, 40);
  push(file, 10, 18, {-6000, 5000});
  push(file, 24, 32, {-6000, 5000});
  const std::string line = refusal(test::solar(), file);
  EXPECT_TRUE(names(line, {"the bucket seems to touch or carry something at 10.0 to 18.0 s, 24.0 to 32.0 s (",
                           "identification needs free motion"}))
      << line;
}

TEST(DataCheck, ALightTouchIsKeptAndTold) {
  recordings::RecordedFile file = as_file(recorded_motion());
  push(file, 10, 12, {-2500, 2500});
  const DataCheck check = require_data(test::solar(), file);
  ASSERT_EQ(check.contact.size(), 1U);
  EXPECT_NEAR(check.contact[0].from_s, 10, 0.51);
  EXPECT_NEAR(check.contact[0].to_s, 12, 0.51);
}

/// As booms do whose position control is lively: by 5 mm, with more force than the weight, which means nothing wrong.
TEST(DataCheck, AcceptsAnArmThatSwingsOnItsOil) {
  const CylinderDescription& boom = test::solar().cylinders[kBoom];
  recordings::RecordedFile file = as_file(recorded_motion());
  for (std::size_t i = 0; i < file.recording.samples.size(); ++i) {
    Measurement& m = file.recording.samples[i];
    const double swing = std::sin(2 * std::numbers::pi * 2.3 * file.recording.step_s * static_cast<double>(i));
    m.cylinder_m[kBoom] += 5e-3 * swing;
    m.pressure_Pa[0] += 80e5 * (1 - swing);
    m.pressure_Pa[1] += 80e5 * (1 + swing) * boom.head_area_m2() / boom.rod_side_area_m2();
  }
  const DataCheck check = require_data(test::solar(), file);
  EXPECT_NEAR(check.weight_ratio[kBoom], 1, 0.1);
}

/// Friction of worn seals outweighs a bucket, and transmitters are off by as much as its weight: neither is a wrong
/// label.
TEST(DataCheck, AcceptsABucketThatFrictionHoldsWhileItStands) {
  const CylinderDescription& bucket = test::solar().cylinders[kBucket];
  recordings::RecordedFile file = as_file(recorded_motion());
  auto& samples = file.recording.samples;
  // Stands for 10 s of every 15 s, and friction then holds first one way and then the other.
  std::vector<Measurement> stopping;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double speed =
        i + 5 < samples.size() ? samples[i + 5].cylinder_m[kBucket] - samples[i].cylinder_m[kBucket] : 0;
    Measurement m = samples[i];
    m.pressure_Pa[4] += (900 * (speed > 0 ? 1 : -1) + 800) / bucket.head_area_m2() + 20e5;
    m.pressure_Pa[5] += 20e5 * bucket.head_area_m2() / bucket.rod_side_area_m2();
    stopping.push_back(m);
    if (i % 1000 != 999) continue;
    for (int k = 0; k < 2000; ++k) {
      Measurement held = m;
      held.pressure_Pa[4] += (k < 1000 ? 1000 : -1000) / bucket.head_area_m2();
      stopping.push_back(held);
    }
  }
  recordings::RecordedFile longer = as_file(recorded_motion());
  longer.recording.samples = stopping;
  longer.recording.usable.assign(stopping.size(), 1);
  const WeightFit fit = weigh(test::solar(), longer.recording);
  EXPECT_TRUE(fit.believable(kBucket)) << fit.ratio[kBucket] << " times the weight, left over " << fit.error[kBucket];
  EXPECT_NEAR(fit.ratio[kBucket], 1, 0.6);
  EXPECT_LT(fit.error[kBucket], 0.7);
}

TEST(DataCheck, NamesSwappedChannels) {
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::string said =
        refusal([&](Measurement& m) { std::swap(m.pressure_Pa[2 * j], m.pressure_Pa[2 * j + 1]); });
    EXPECT_TRUE(names(said, {recordings::kSignalNames[2 * j], recordings::kSignalNames[2 * j + 1], "swapped"})) << said;
  }
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{6, 7}, {6, 8}, {7, 8}}) {
    const std::string lengths =
        refusal([&](Measurement& m) { std::swap(recordings::signal(m, a), recordings::signal(m, b)); });
    EXPECT_TRUE(names(lengths, {recordings::kSignalNames[a], recordings::kSignalNames[b], "look swapped"})) << lengths;
    EXPECT_FALSE(names(lengths, {"valve"})) << "commands fit, only lengths do not: " << lengths;
  }
  const std::string pairs = refusal([](Measurement& m) {
    std::swap(m.pressure_Pa[0], m.pressure_Pa[2]);
    std::swap(m.pressure_Pa[1], m.pressure_Pa[3]);
  });
  EXPECT_TRUE(names(pairs, {"boom_head_Pa", "arm_rod_Pa", "swapped"})) << pairs;
}

TEST(DataCheck, NamesWrongUnits) {
  constexpr double kBar = 1e5, kPsi = 6894.757;
  const auto pressures = [](double factor) {
    return refusal([factor](Measurement& m) {
      for (double& p : m.pressure_Pa) p *= factor;
    });
  };
  EXPECT_TRUE(names(pressures(1 / kBar), {"boom_head_Pa", "bucket_rod_Pa", "bar taken as Pa"})) << pressures(1 / kBar);
  EXPECT_TRUE(names(pressures(1 / kPsi), {"psi taken as Pa"})) << pressures(1 / kPsi);
  EXPECT_TRUE(names(pressures(kBar / kPsi), {"boom_head_Pa", "psi taken as bar"})) << pressures(kBar / kPsi);
  EXPECT_TRUE(names(pressures(kBar), {"boom_head_Pa", "Pa taken as bar"})) << pressures(kBar);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::string one = refusal([j](Measurement& m) {
      m.pressure_Pa[2 * j] /= kBar;
      m.pressure_Pa[2 * j + 1] /= kBar;
    });
    EXPECT_TRUE(names(one, {recordings::kSignalNames[2 * j], "bar taken as Pa"})) << one;
    const std::string mm = refusal([j](Measurement& m) { m.cylinder_m[static_cast<Eigen::Index>(j)] *= 1000; });
    EXPECT_TRUE(names(mm, {recordings::kSignalNames[recordings::kPressureChannels + j], "millimetres taken as metres"}))
        << mm;
  }
  const std::string tilt = refusal([](Measurement& m) { m.hull_pitch_rad *= 180 / std::numbers::pi; });
  EXPECT_TRUE(names(tilt, {"hull_pitch_rad", "degrees taken as radians"})) << tilt;
}

TEST(DataCheck, RefusesPressuresOfAnotherTransmitterRangeOnMachinesOfEachDrawing) {
  const MachineDescription compact = load_machine(find_config("machine", "compact080"));
  const estimation::JointPath path = estimation::slow_sweeps(compact, 40);
  motion::MachineRun run(compact, sim::sample_truth(compact, 1), {}, path.joint_rad.front(), 1);
  const recordings::RecordedFile sampled = as_file(run.follow(path).recording);
  EXPECT_EQ(refusal(compact, sampled), "accepted");
  for (const auto& [machine, file] : {std::pair{test::solar(), as_file(recorded_motion())}, {compact, sampled}}) {
    for (const double factor : {0.63, 1.6}) {
      recordings::RecordedFile scaled = file;
      for (Measurement& m : scaled.recording.samples) {
        for (double& p : m.pressure_Pa) p *= factor;
      }
      EXPECT_TRUE(names(refusal(machine, scaled), {"pressures all balance", "range"})) << machine.name << factor;
    }
  }
}

TEST(DataCheck, NamesWrongSigns) {
  for (std::size_t c = 0; c + 1 < recordings::kSignalChannels; ++c) {
    const std::string said = refusal([c](Measurement& m) { recordings::signal(m, c) = -recordings::signal(m, c); });
    EXPECT_TRUE(names(said, {recordings::kSignalNames[c]})) << said;
    EXPECT_TRUE(c == 1 || c == 3 || c == 5 || names(said, {"wrong sign"})) << said;
  }
}

TEST(DataCheck, RefusesAllZeroPressuresAndAnyChannelThatIsZeroThroughout) {
  EXPECT_TRUE(names(refusal([](Measurement& m) { m.pressure_Pa.fill(0); }), {"boom_head_Pa is zero throughout"}));
  for (std::size_t c = 0; c + 1 < recordings::kSignalChannels; ++c) {
    const std::string said = refusal([c](Measurement& m) { recordings::signal(m, c) = 0; });
    EXPECT_TRUE(names(said, {std::string(recordings::kSignalNames[c]) + " is zero throughout"})) << said;
  }
}

/// Defects of single samples and stretches: what is done to samples first ... first + count - 1 of a channel.
struct Defect {
  const char* name;
  std::size_t count;
  std::function<double(double)> spoil;
  std::vector<std::size_t> channels;
};

TEST(DataCheck, NamesAndTakesOutDropOutsSpikesAndStretchesOutOfRange) {
  const std::vector<Defect> defects{
      {"drop-out", 1, [](double) { return 0.0; }, {0, 2, 6, 7, 8}},
      {"drop-out", 3, [](double) { return 0.0; }, {0, 2, 6, 7, 8}},
      {"drop-out", 50, [](double) { return 0.0; }, {0, 2, 6, 7, 8}},
      {"spike", 1, [](double x) { return x + 60e5; }, {0, 1, 2, 3, 4, 5}},
      {"spike", 1, [](double x) { return x - 0.03; }, {6, 7, 8}},
      {"outside", 20, [](double x) { return x + 2; }, {6, 7, 8}},
      {"outside", 1, [](double) { return 450e5; }, {0, 3, 5}},
      {"outside", 5, [](double) { return 1.5; }, {9}},
  };
  std::mt19937 random(7);
  for (const Defect& defect : defects) {
    for (const std::size_t c : defect.channels) {
      recordings::RecordedFile file = as_file(recorded_motion());
      std::size_t first = 0;
      do {
        first = std::uniform_int_distribution<std::size_t>(100, file.recording.samples.size() - 200)(random);
      } while (recordings::signal(file.recording.samples[first - 1], c) < 8e5 && c < 6 &&
               std::string(defect.name) == "drop-out");
      for (std::size_t i = first; i < first + defect.count; ++i)
        recordings::signal(file.recording.samples[i], c) =
            defect.spoil(recordings::signal(file.recording.samples[i], c));
      const DataCheck check = require_data(test::solar(), file);
      ASSERT_FALSE(check.findings.empty()) << defect.name << " in " << recordings::kSignalNames[c] << " at " << first;
      const DataFinding& found = check.findings.front();
      EXPECT_EQ(found.column, recordings::kSignalNames[c]) << defect.name;
      EXPECT_EQ(found.first_row, first + 2) << defect.name << " in " << recordings::kSignalNames[c];
      EXPECT_EQ(found.last_row, first + defect.count + 1) << defect.name << " in " << recordings::kSignalNames[c];
      EXPECT_NE(found.what.find(defect.name), std::string::npos) << found.what;
      // Short ones are bridged between their neighbours, long ones are not usable; nothing of them is left.
      for (std::size_t i = first; i < first + defect.count; ++i) {
        if (file.recording.usable[i] == 0) continue;
        const double was = recordings::signal(recorded_motion().samples[i], c),
                     is = recordings::signal(file.recording.samples[i], c);
        EXPECT_NEAR(is, was,
                    c < 6   ? 15e5
                    : c < 9 ? 2e-3
                            : 0.01)
            << defect.name << " in " << recordings::kSignalNames[c];
      }
    }
  }
}

/// The same for commands.
std::string valve_refusal(const std::function<void(JointVector&)>& spoil) {
  recordings::RecordedFile file = as_file(recorded_motion());
  for (JointVector& command : file.recording.valve) spoil(command);
  return refusal(test::solar(), file);
}

TEST(DataCheck, NamesCommandsInPercentWithTheWrongSignOrOfAnotherAxis) {
  for (int j = 0; j < kJoints; ++j) {
    const std::string column = std::string(kJointNames[static_cast<std::size_t>(j)]) + "_valve";
    const std::string percent = valve_refusal([j](JointVector& command) { command[j] *= 100; });
    EXPECT_TRUE(names(percent, {column, "looks like percent taken as a fraction"})) << percent;
    const std::string sign = valve_refusal([j](JointVector& command) { command[j] *= -1; });
    EXPECT_TRUE(names(sign, {column + " has the wrong sign"})) << sign;
    const int next = (j + 1) % kJoints;
    const std::string other = valve_refusal([&](JointVector& command) { std::swap(command[j], command[next]); });
    EXPECT_TRUE(names(other, {column, std::string(kJointNames[static_cast<std::size_t>(next)]) + " follows " + column}))
        << other;
  }
  const std::string cycle =
      valve_refusal([](JointVector& command) { command = JointVector(command[1], command[2], command[0]); });
  EXPECT_TRUE(names(cycle, {"boom follows bucket_valve, arm follows boom_valve, bucket follows arm_valve"})) << cycle;
  EXPECT_EQ(valve_refusal([](JointVector& command) { command[kArm] = std::nan(""); }), "accepted");
}

TEST(DataCheck, TakesOutCommandsThatTheCylinderDoesNotFollow) {
  recordings::RecordedFile file = as_file(recorded_motion());
  std::mt19937 random(3);
  for (JointVector& command : file.recording.valve) command[kBoom] = std::uniform_real_distribution<>(-1, 1)(random);
  const DataCheck check = require_data(test::solar(), file);
  ASSERT_EQ(check.findings.size(), 1U);
  EXPECT_TRUE(names(check.lines().front(), {"boom_valve: its cylinder does not follow it, not used"}));
  EXPECT_TRUE(std::isnan(file.recording.valve[505][kBoom]));
  EXPECT_EQ(file.recording.valve[505][kArm], recorded_motion().valve[505][kArm]);
}

/// As recordings of poses at rest are: the ways between them are left out.
TEST(DataCheck, TakesNoMotionAcrossWhatWasNotRecordedForOneThatValvesMade) {
  constexpr std::size_t kStops = 300, kRest = 40;
  recordings::RecordedFile file = as_file(recorded_motion());
  estimation::Recording& recording = file.recording;
  const auto held = recording.samples.front();
  recording.samples.clear();
  for (std::size_t stop = 0; stop < kStops; ++stop) {
    recording.samples.insert(recording.samples.end(), kRest + 1, held);
    for (auto at = recording.samples.end() - kRest - 1; at != recording.samples.end(); ++at)
      at->cylinder_m.array() += stop % 2 == 0 ? 0.0 : 0.03;
  }
  recording.usable.assign(recording.samples.size(), 1);
  for (std::size_t i = kRest; i < recording.samples.size(); i += kRest + 1) recording.usable[i] = 0;
  recording.valve.assign(recording.samples.size(), JointVector::Zero());
  file.rows.resize(recording.samples.size(), 2);
  EXPECT_TRUE(check_valves(file).empty());
  std::fill(recording.usable.begin(), recording.usable.end(), 1);
  EXPECT_EQ(check_valves(file).size(), 3U) << "it would have moved without commands";
}

TEST(DataCheck, TakesOutSingleCommandsThatCannotBeAndSaysForWhichValve) {
  recordings::RecordedFile file = as_file(recorded_motion());
  for (std::size_t i = 500; i < 510; ++i) file.recording.valve[i][kBucket] = 1.5;
  const DataCheck check = require_data(test::solar(), file);
  ASSERT_EQ(check.findings.size(), 1U);
  EXPECT_EQ(check.lines().front(), "bucket_valve: outside [-1, 1], not used for this valve, 10 samples (row 502-511)");
  EXPECT_TRUE(std::isnan(file.recording.valve[505][kBucket]));
  EXPECT_EQ(file.recording.valve[505][kBoom], recorded_motion().valve[505][kBoom]);
  EXPECT_EQ(file.recording.usable, recorded_motion().usable);
}

TEST(DataCheck, NamesAStuckPressureAndAStuckLength) {
  for (std::size_t c = 0; c + 1 < recordings::kSignalChannels; ++c) {
    recordings::RecordedFile file = as_file(recorded_motion());
    // Where the cylinder moves for three seconds.
    const std::size_t length = c < 6 ? 6 + c / 2 : c;
    std::size_t first = 0;
    const auto& samples = recorded_motion().samples;
    for (std::size_t i = 200; i + 800 < samples.size() && first == 0; ++i)
      if (std::abs(recordings::signal(samples[i + 600], length) - recordings::signal(samples[i], length)) > 0.06)
        first = i;
    ASSERT_GT(first, 0u);
    for (std::size_t i = first + 1; i < first + 600; ++i)
      recordings::signal(file.recording.samples[i], c) = recordings::signal(file.recording.samples[first], c);
    const DataCheck check = require_data(test::solar(), file);
    ASSERT_FALSE(check.findings.empty()) << recordings::kSignalNames[c];
    const DataFinding& found = check.findings.front();
    EXPECT_EQ(found.column, recordings::kSignalNames[c]);
    EXPECT_NE(found.what.find("stuck"), std::string::npos) << found.what;
    EXPECT_LE(found.first_row, first + 3) << "a cylinder may have stood still before";
    EXPECT_EQ(found.last_row, first + 601);
    EXPECT_EQ(file.recording.usable[first + 300], 0);
  }
}

}  // namespace
}  // namespace knuckle::identify
