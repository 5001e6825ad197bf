#include "app/operators/study.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/bad_toml.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::operators {
namespace {

// Student (1908), "The probable error of a mean", Biometrika 6: hours of sleep gained by ten patients with two drugs.
// R's documentation of t.test has the paired interval of its data set `sleep`: 0.7001142 to 2.4598858, mean 1.58.
constexpr double kFirstDrug_h[] = {0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0};
constexpr double kSecondDrug_h[] = {1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4};

TEST(MeanInterval, IsStudentsOwnOfTheSleepOfTenPatients) {
  std::vector<double> gained;
  for (int i = 0; i < 10; ++i) gained.push_back(kSecondDrug_h[i] - kFirstDrug_h[i]);
  const MeanInterval interval = mean_interval(gained);
  EXPECT_EQ(interval.n, 10u);
  EXPECT_NEAR(interval.mean.value(), 1.58, 1e-12);
  EXPECT_NEAR(*interval.mean - interval.half_width.value(), 0.7001142, 1e-7);
  EXPECT_NEAR(*interval.mean + interval.half_width.value(), 2.4598858, 1e-7);
}

TEST(MeanInterval, NeedsTwoValues) {
  EXPECT_FALSE(mean_interval({}).mean);
  EXPECT_EQ(mean_interval({3}).mean, 3);
  EXPECT_FALSE(mean_interval({3}).half_width);
}

MeasuredRecording trial(const std::string& participant, const std::string& condition, Metric value) {
  MeasuredRecording recording;
  recording.plan = {participant + condition, participant, "haptic", condition, "sleep", {}};
  recording.metrics.task_time_s = value;
  return recording;
}

const StudyRow* row_of(const std::vector<StudyRow>& rows, const std::string& metric, const std::string& of,
                       const std::string& minus) {
  for (const StudyRow& row : rows) {
    if (row.metric == metric && row.of == of && row.minus == minus) return &row;
  }
  return nullptr;
}

TEST(Study, ComparesConditionsByTheDifferencesOfThoseWhoDidBoth) {
  std::vector<MeasuredRecording> recordings;
  for (int i = 0; i < 10; ++i) {
    recordings.push_back(trial("p" + std::to_string(i), "first", kFirstDrug_h[i]));
    recordings.push_back(trial("p" + std::to_string(i), "second", kSecondDrug_h[i]));
  }
  recordings.push_back(trial("only first", "first", 100));
  recordings.push_back(trial("nothing measured", "second", std::nullopt));
  const std::vector<StudyRow> rows = study_rows(recordings, &PlannedRecording::condition);
  const StudyRow* paired = row_of(rows, "task_time", "second", "first");
  ASSERT_NE(paired, nullptr);
  EXPECT_EQ(paired->interval.n, 10u);
  EXPECT_NEAR(paired->interval.mean.value(), 1.58, 1e-12);
  EXPECT_NEAR(paired->interval.half_width.value(), 0.8798858, 1e-7);
  EXPECT_EQ(row_of(rows, "task_time", "first", "")->interval.n, 11u);
  EXPECT_EQ(row_of(rows, "task_time", "second", "")->interval.n, 10u);
  EXPECT_EQ(row_of(rows, "peak_contact_force", "first", ""), nullptr) << "nobody touched anything";
}

TEST(Study, CountsTheTrialsOfAParticipantAsTheirMeanAndNothingOfATrialThatIsNotWhole) {
  MeasuredRecording cut = trial("b", "x", 500);
  cut.plan.load = TaskLoad{10, 20, 30, 40, 50, 60};
  cut.flaws = {"cut.mcap: has no end"};
  const std::vector<StudyRow> rows =
      study_rows({trial("a", "x", 1), trial("a", "x", 3), trial("b", "x", 6), cut}, &PlannedRecording::condition);
  ASSERT_EQ(rows.size(), 1u) << "nor of its questionnaire";
  EXPECT_EQ(rows[0].interval.n, 2u);
  EXPECT_DOUBLE_EQ(rows[0].interval.mean.value(), 4);
}

TEST(Study, WritesWhatIsNoneAsNullAndNotAsZero) {
  MeasuredRecording recording = trial("a", "x, y", 1);
  recording.plan.load = TaskLoad{10, 20, 30, 40, 50, 60};
  std::ostringstream csv, json;
  write_csv({recording}, csv);
  EXPECT_NE(csv.str().find("participant,input,condition,task,task_time_s,bookmarked_time_s,"), std::string::npos);
  EXPECT_NE(csv.str().find("\n\"ax, y\",a,haptic,\"x, y\",sleep,1,,"), std::string::npos) << csv.str();
  write_json({recording}, study_rows({recording}, &PlannedRecording::condition), "condition", json);
  const auto read = nlohmann::json::parse(json.str());
  EXPECT_EQ(read["schema"], "knuckle-operators/1");
  EXPECT_EQ(read["recordings"][0]["metrics"]["task_time"], 1);
  EXPECT_TRUE(read["recordings"][0]["metrics"]["peak_contact_force"].is_null());
  EXPECT_EQ(read["recordings"][0]["tlx"]["frustration"], 60);
  EXPECT_TRUE(read["rows"][0]["half_width"].is_null());
  EXPECT_EQ(read["rows"].back()["metric"], "tlx_raw");
  EXPECT_EQ(read["rows"].back()["mean"], 35);
}

std::string refusal_of(const std::string& text) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("plan.toml")) << text;
  return test::refusal([&] { return load_plan(folder.file("plan.toml")); });
}

const std::string kOne =
    "[[recording]]\nfile = \"a.mcap\"\nparticipant = \"p1\"\ninput = \"haptic\"\n"
    "condition = \"force\"\ntask = \"press\"\n";
const std::string kLoad = "tlx = {mental = 1, physical = 2, temporal = 3, performance = 4, effort = 5, frustration = ";

TEST(StudyPlan, OfWhichNoOtherCommandShowsAllErrorsDoesNotNameOne) {
  const std::string said = refusal_of("[[recording]]\nfile = 1\ninput = \"foot\"\n");
  EXPECT_TRUE(test::says(said, " (first of ")) << said;
  EXPECT_TRUE(said.ends_with(" errors)")) << said;
}

TEST(StudyPlan, IsReadWithItsFilesBesideIt) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("plan.toml")) << kOne << kLoad << "6}\n";
  const auto plan = load_plan(folder.file("plan.toml"));
  ASSERT_EQ(plan.size(), 1u);
  EXPECT_EQ(plan[0].file, folder.file("a.mcap"));
  EXPECT_EQ(plan[0].participant, "p1");
  EXPECT_EQ(plan[0].input, "haptic");
  EXPECT_EQ(plan[0].condition, "force");
  EXPECT_EQ(plan[0].task, "press");
  EXPECT_EQ(plan[0].load.value()[5], 6);
}

TEST(StudyPlan, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(refusal_of(kOne), "accepted");
  const test::TemporaryFolder folder;
  const std::string path = folder.file("plan.toml");
  test::expect_bad_tomls_refused(path, kOne + kLoad + "6}\n", [&] { (void)load_plan(path); });
  for (const auto& [text, said] : {std::pair{std::string(), "at least one [[recording]] is needed"},
                                   {kOne + "age = 40\n", "age"},
                                   {kOne + kOne, "is listed before"},
                                   {kOne + kLoad + "101}\n", "must be within [0, 100]"},
                                   {kOne + "tlx = {mental = 1}\n", "physical"}})
    EXPECT_TRUE(test::says(refusal_of(text), said));
}

}  // namespace
}  // namespace knuckle::operators
