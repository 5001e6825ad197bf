// What is counted of two contact models on one recording, on made-up steps.
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "app/replay/replay_command.h"
#include "estimation/force_estimator.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::replay {
namespace {

constexpr int kSteps = 100;

slave::SlaveState state_at(int step, double force_x_N) {
  slave::SlaveState state;
  state.at = Time(step * 5ms);
  state.measured = true;
  state.tip_force_N = {force_x_N, 0};
  return state;
}

/// Recorded force of step k: k newtons; the true one is `off_N` more from step 50 on, else 0.
std::string session_table(const test::TemporaryFolder& folder, double off_N, double recorded_more_N = 0) {
  const std::string file = folder.file("session.csv");
  std::ofstream out(file);
  out << "time_s,tip_force_x_N,tip_force_z_N,truth_tip_force_x_N,truth_tip_force_z_N\n";
  for (int k = 0; k < kSteps; ++k)
    out << 0.005 * k << ',' << k + recorded_more_N << ",0," << (k < 50 ? 0 : k + off_N) << ",0\n";
  return file;
}

/// Words of the line that begins with this.
std::vector<std::string> words_of(const std::string& text, const std::string& begin) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find(begin) == std::string::npos) continue;
    std::istringstream in(line.substr(line.find(begin) + begin.size()));
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
  }
  return {};
}

using Words = std::vector<std::string>;

TEST(ForceComparison, TellsHowOftenEachModelAnswersAndHowFarTheTwoAreApart) {
  ForceComparison forces(ContactModel::kBucketForce, ContactModel::kTipWrench, "");
  for (int k = 0; k < kSteps; ++k) {
    slave::SlaveState replayed = state_at(k, 2.0 * k);  // k newtons more
    if (k < 20) replayed.confidence_reasons = estimation::kStraightArm | estimation::kFastMotion;
    slave::SlaveState recorded = state_at(k, k);
    recorded.confidence_reasons = estimation::kFastMotion;  // a doubt is no refusal
    forces.add(recorded, replayed);
  }
  const std::string text = forces.text();
  EXPECT_TRUE(test::says(text, "in 100 steps"));
  EXPECT_EQ(words_of(text, "bucket_force, recorded"), (Words{"100.0", "%", "59.0", "95.0"})) << text;
  EXPECT_EQ(words_of(text, "tip_wrench, replayed"), (Words{"80.0", "%", "59.0", "95.0"})) << text;
  EXPECT_FALSE(test::says(text, "true force"));
}

TEST(ForceComparison, TellsHowFarEachIsOffTheTrueForceAndHowFarWhileSomethingTouches) {
  const test::TemporaryFolder folder;
  ForceComparison forces(ContactModel::kBucketForce, ContactModel::kTipForceOfTwo, session_table(folder, 7));
  for (int k = 0; k < kSteps; ++k) forces.add(state_at(k, k), state_at(k, k + 10));
  const std::string text = forces.text();
  EXPECT_EQ(words_of(text, "bucket_force, recorded"),
            (Words{"100.0", "%", "10.0", "10.0", "7.0", "44.0", "7.0", "7.0"}))
      << text;
  EXPECT_EQ(words_of(text, "tip_force_of_two, replayed"),
            (Words{"100.0", "%", "10.0", "10.0", "3.0", "54.0", "3.0", "3.0"}))
      << text;
}

TEST(ForceComparison, OfStepsInWhichNotEverySensorWasHeardSaysNothing) {
  ForceComparison forces(ContactModel::kBucketForce, ContactModel::kTipWrench, "");
  slave::SlaveState before = state_at(0, 0);
  before.measured = false;
  forces.add(before, before);
  EXPECT_EQ(forces.text(), "");
}

TEST(ForceComparison, RefusesATableOfAnotherSessionOrOfOtherTimesOrWithoutATrueForce) {
  const test::TemporaryFolder folder;
  const auto compared = [](const std::string& file, int step) {
    return test::refusal([&] {
      ForceComparison forces(ContactModel::kBucketForce, ContactModel::kTipWrench, file);
      forces.add(state_at(step, step), state_at(step, step));
      (void)forces.text();
    });
  };
  EXPECT_TRUE(test::says(compared(session_table(folder, 0, 0.5), 3),
                         "session.csv: is of another session than the recording: at 0.0150 s"));
  EXPECT_TRUE(test::says(compared(session_table(folder, 0), kSteps), "has no row of a step of this recording"));
  std::ofstream(folder.file("machine.csv")) << "time_s,tip_force_x_N,tip_force_z_N\n0,1,2\n";
  EXPECT_TRUE(test::says(compared(folder.file("machine.csv"), 0), "no column 'truth_tip_force_x_N'"));
}

}  // namespace
}  // namespace knuckle::replay
