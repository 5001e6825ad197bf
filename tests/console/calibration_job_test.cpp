// Commissioning and identification by buttons: the same words as at a terminal, and a file only when it was accepted.
#include "app/console/calibration_job.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "core/error.h"
#include "machine/load.h"

namespace knuckle::console {
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
  static std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path folder_;
};

/// What somebody who sees the machine do what it should would press.
std::string right_answer(const bringup::Question& question, bool& extends) {
  for (const std::string& word : question.words) {
    if (word == "tape") return word;
    if (word == "longer") return extends ? "longer" : "shorter";
  }
  if (question.bounds) return "0";  // the hull stands level
  extends = question.text.find("extends") != std::string::npos;
  return question.words.front();
}

/// Looks at every new state until one is so, or for much longer than any job takes.
CalibrationState until(CalibrationJob& job, const std::function<bool(const CalibrationState&)>& so) {
  constexpr int kMostLooks = 300'000;
  std::uint64_t seen = 0;
  CalibrationState last;
  for (int look = 0; look < kMostLooks; ++look, std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    const auto state = job.newer(seen);
    if (state && so(*state)) return *state;
    if (state) last = *state;
  }
  ADD_FAILURE() << "it never came to that: " << last.outcome;
  return last;
}

bool is_over(const CalibrationState& state) {
  return state.stage == CalibrationStage::kOver;
}

/// Answers until the stage is reached or the job is over.
CalibrationState answer_until(CalibrationJob& job, CalibrationStage stage) {
  return until(job, [&job, stage, extends = false](const CalibrationState& state) mutable {
    if (state.stage == stage || is_over(state)) return true;
    if (state.question) job.answer(right_answer(*state.question, extends));
    return false;
  });
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
  ASSERT_TRUE(over.accepted) << over.outcome;
  EXPECT_TRUE(load_machine(target()).dynamics_calibration);
  const std::string accepted = text_of(target());
  const std::string kept = roll_back(*over.accepted);
  EXPECT_FALSE(fs::exists(target())) << "as before";
  EXPECT_EQ(text_of(kept), accepted) << "minutes of work are not thrown away";
}

TEST_F(CalibrationJobTest, KeepsTheFileBeforeAndRollsBackToItThroughALink) {
  const fs::path real = folder_ / "real", file = real / "mine.toml";
  fs::create_directory(real);
  fs::copy_file(find_config("machine", "solar015"), file);
  const std::string before = text_of(file);
  fs::create_symlink(file, target());
  CalibrationJob job(plan());
  ASSERT_EQ(answer_until(job, CalibrationStage::kDecision).stage, CalibrationStage::kDecision);
  job.accept();
  const CalibrationState over = until(job, is_over);
  ASSERT_TRUE(over.accepted) << over.outcome;
  EXPECT_TRUE(load_machine(file.string()).dynamics_calibration);
  EXPECT_EQ(text_of(over.accepted->kept), before);
  const std::string accepted = text_of(file), kept = roll_back(*over.accepted);
  EXPECT_EQ(text_of(file), before);
  EXPECT_EQ(text_of(kept), accepted);
  EXPECT_EQ(fs::path(kept).parent_path(), real) << "beside the file itself";
  EXPECT_FALSE(fs::exists(over.accepted->kept));
  EXPECT_TRUE(fs::is_symlink(target())) << "a link stays a link";
  EXPECT_THROW((void)roll_back(*over.accepted), InputError) << "there is nothing to go back to any more";
  EXPECT_EQ(text_of(file), before);
}

TEST_F(CalibrationJobTest, RollsBackNothingThatSomebodyElseWroteSince) {
  const std::string kept = (folder_ / "calibrated.1.toml").string();
  std::ofstream(kept) << "old";
  std::ofstream(target()) << "somebody else's";
  for (const Acceptance& accepted : {Acceptance{target(), "", "new"}, Acceptance{target(), kept, "new"}}) {
    try {
      (void)roll_back(accepted);
      ADD_FAILURE() << "rolled back over it";
    } catch (const InputError& refused) {
      EXPECT_EQ(refused.what(), target() + ": not rolled back: the file has changed since it was accepted");
    }
    EXPECT_EQ(text_of(target()), "somebody else's");
    EXPECT_EQ(text_of(kept), "old");
    EXPECT_FALSE(fs::exists(folder_ / "calibrated.2.toml"));
  }
}

TEST_F(CalibrationJobTest, AsksAgainAfterAWrongWordAndWritesNothing) {
  CalibrationJob job(plan());
  const CalibrationState over = until(job, [&job, said = false](const CalibrationState& state) mutable {
    for (const std::string& line : state.said) EXPECT_EQ(line.find("Enter"), std::string::npos) << line;
    for (const std::string& line : state.said)
      if (line.find("'what?'") != std::string::npos) job.cancel();
    if (state.question && !said) {
      job.answer("what?");
      said = true;
    }
    return is_over(state);
  });
  EXPECT_NE(over.outcome.find("cancelled"), std::string::npos) << over.outcome;
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(CalibrationJobTest, CanBeCancelledWhileAQuestionWaits) {
  CalibrationJob job(plan());
  (void)until(job, [](const CalibrationState& state) { return state.question.has_value(); });
  job.cancel();
  EXPECT_NE(until(job, is_over).outcome.find("cancelled"), std::string::npos);
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(CalibrationJobTest, RefusesBeforeItBeginsATargetThatCannotBeWrittenOrIsSomethingElse) {
  std::ofstream(folder_ / "text.toml") << "this is no machine\n";
  fs::create_directory(folder_ / "folder.toml");
  fs::create_symlink(folder_ / "nowhere.toml", folder_ / "link.toml");
  fs::create_symlink(folder_ / "itself.toml", folder_ / "itself.toml");
  for (const char* name : {"text.toml/calibrated.toml", "text.toml", "folder.toml", "link.toml", "itself.toml"}) {
    CalibrationPlan bad = plan();
    bad.target = (folder_ / name).string();
    try {
      const CalibrationJob job(bad);
      ADD_FAILURE() << name << " was taken";
    } catch (const InputError& refused) {
      const std::string said = refused.what();
      EXPECT_NE(said.find(bad.target), std::string::npos) << said;
      EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    }
  }
}

}  // namespace
}  // namespace knuckle::console
