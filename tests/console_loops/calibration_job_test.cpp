// Commissioning and identification by buttons: the same words as at a terminal, and a file only when it was accepted.
#include "app/console/calibration_job.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "machine/load.h"

namespace knuckle::app {
namespace {

namespace fs = std::filesystem;

class CalibrationJobTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string folder = (fs::temp_directory_path() / "knuckle_calibration_XXXXXX").string();
    ASSERT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] CalibrationPlan plan() const {
    return {.machine = "solar015", .target = target(), .seed = 3, .slow_s = 60, .fast_s = 40, .pace = 0};
  }
  [[nodiscard]] std::string target() const { return (folder_ / "calibrated.toml").string(); }
  [[nodiscard]] bool folder_is_empty() const { return fs::is_empty(folder_); }
  fs::path folder_;
};

/// What somebody who sees the machine do what it should would press.
std::string right_answer(const Dialogue::Question& question, bool& extends) {
  for (const std::string& word : question.words) {
    if (word == "tape") return word;
    if (word == "longer") return extends ? "longer" : "shorter";
  }
  if (question.bounds) return "0";  // the hull stands level
  extends = question.text.find("extends") != std::string::npos;
  return question.words.front();
}

/// Answers until the stage is reached or the job is over.
CalibrationState answer_until(CalibrationJob& job, CalibrationStage stage) {
  std::uint64_t seen = 0;
  bool extends = false;
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    const auto state = job.newer(seen);
    if (!state) continue;
    if (state->stage == stage || state->stage == CalibrationStage::kOver) return *state;
    if (state->question) job.answer(right_answer(*state->question, extends));
  }
}

TEST_F(CalibrationJobTest, LeadsFromIdentityToAnAcceptedFileAndBack) {
  CalibrationJob job(plan());
  const CalibrationState ready = answer_until(job, CalibrationStage::kDecision);
  ASSERT_EQ(ready.stage, CalibrationStage::kDecision) << ready.outcome;
  EXPECT_TRUE(ready.usable) << ready.verdict;
  EXPECT_TRUE(folder_is_empty()) << "nothing is written before it is accepted";
  ASSERT_EQ(ready.hold_out.size(), 2U);
  for (const HoldOutRow& row : ready.hold_out) {
    EXPECT_LT(row.new_nrmse.maxCoeff(), 0.15) << row.recording;
    EXPECT_FALSE(row.old_nrmse) << "the drawing has no calibration";
  }
  ASSERT_FALSE(ready.condition_numbers.empty());
  EXPECT_LT(ready.condition_numbers.back(), ready.condition_numbers.front()) << "poses tell more and more";
  job.accept();
  const CalibrationState over = answer_until(job, CalibrationStage::kOver);
  EXPECT_TRUE(over.accepted) << over.outcome;
  EXPECT_TRUE(load_machine(target()).dynamics_calibration);
  roll_back(target(), over.kept);
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(CalibrationJobTest, KeepsTheFileBeforeAndRollsBackToIt) {
  const std::string kept = (folder_ / "calibrated.1.toml").string();
  std::ofstream(target()) << "new";
  std::ofstream(kept) << "old";
  roll_back(target(), kept);
  std::ostringstream now;
  now << std::ifstream(target()).rdbuf();
  EXPECT_EQ(now.str(), "old");
  EXPECT_FALSE(fs::exists(kept));
  EXPECT_THROW(roll_back(target(), kept), InputError) << "there is nothing to go back to any more";
  EXPECT_TRUE(fs::exists(target()));
}

TEST_F(CalibrationJobTest, EndsAtAWrongWordAndWritesNothing) {
  CalibrationJob job(plan());
  std::uint64_t seen = 0;
  for (bool said = false;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    const auto state = job.newer(seen);
    if (state && state->question && !said) {
      job.answer("what?");
      said = true;
    }
    if (!state || state->stage != CalibrationStage::kOver) continue;
    EXPECT_NE(state->outcome.find("'what?'"), std::string::npos) << state->outcome;
    break;
  }
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(CalibrationJobTest, CanBeCancelledWhileAQuestionWaits) {
  CalibrationJob job(plan());
  std::uint64_t seen = 0;
  while (!job.newer(seen).value_or(CalibrationState{}).question) std::this_thread::yield();
  job.cancel();
  EXPECT_NE(answer_until(job, CalibrationStage::kOver).outcome.find("cancelled"), std::string::npos);
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(CalibrationJobTest, RefusesATargetThatCannotBeWritten) {
  CalibrationPlan bad = plan();
  bad.target = (folder_ / "none" / "calibrated.toml").string();
  EXPECT_THROW(CalibrationJob{bad}, InputError);
}

}  // namespace
}  // namespace knuckle::app
