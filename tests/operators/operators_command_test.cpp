// The command as it is run.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "app/operators/study.h"
#include "recording/mcap/file_writer.h"
#include "recording/topics.h"
#include "tests/operators/recorded_sessions.h"
#include "tests/support/run_inside.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::operators {
namespace {

std::string planned(const std::string& file, const std::string& participant, const std::string& condition) {
  return "[[recording]]\nfile = \"" + file + "\"\nparticipant = \"" + participant +
         "\"\ninput = \"haptic\"\ncondition = \"" + condition + "\"\ntask = \"reach\"\n";
}

class OperatorsCommand : public testing::Test {
 protected:
  void write_plan(const std::string& text) const { std::ofstream(plan_) << text; }
  [[nodiscard]] test::ProgramRun run(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> arguments{"operators", "--plan", plan_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run_inside({"knuckle-studies", "", "", {operators_entry()}}, arguments);
  }
  test::TemporaryFolder folder_;
  std::string plan_ = folder_.file("plan.toml");
};

/// A person engages and waits for so long.
std::string waiting(int seconds) {
  return "name = \"reach\"\ndescription = \"Of a test\"\nreference_reach_m = 3.2\nreference_payload_kg = 150\n"
         "start_deg = [40, -75, -40]\nhand_deg = [42, -77, -38]\nduration_s = 5\n[operator]\nlimb = \"normal\"\n"
         "reaction_ms = 200\n[[phase]]\nname = \"engage\"\nkind = \"engage\"\n[[phase]]\nname = \"wait\"\n"
         "kind = \"wait\"\nduration_s = " +
         std::to_string(seconds) + "\n";
}

TEST_F(OperatorsCommand, MakesOneTableOfSeveralRecordingsAndCountsNoneThatIsCutOff) {
  const std::string cut = folder_.file("cut.mcap");
  test::record(waiting(1), folder_.file("short.mcap"));
  test::record(waiting(2), folder_.file("long.mcap"));
  for (const char* copy : {"other_long.mcap", "cut.mcap"})
    std::filesystem::copy(folder_.file("long.mcap"), folder_.file(copy));
  std::filesystem::copy(folder_.file("short.mcap"), folder_.file("other.mcap"));
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) * 6 / 10);
  write_plan(planned("short.mcap", "a", "x") + planned("long.mcap", "a", "y") +
             planned("../" + folder_.path().filename().string() + "/other.mcap", "b", "x") +
             planned("other_long.mcap", "b", "y") + planned("cut.mcap", "c", "x"));
  const auto result = run({"--json", folder_.file("o.json"), "--csv", folder_.file("o.csv")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(test::says(result.err, cut + ": "));
  EXPECT_TRUE(test::says(result.err, "; it has no end: its program was killed, or the disk refused the rest\n"));
  EXPECT_FALSE(test::says(result.err, folder_.file("short.mcap")));
  EXPECT_TRUE(test::says(result.out, "task reach: means over participants"));
  EXPECT_TRUE(test::says(result.out, "y - x"));
  EXPECT_TRUE(test::says(result.out, "not whole:\n  c, x, task reach: " + cut));
  const auto json = nlohmann::json::parse(test::content(folder_.file("o.json")));
  bool compared = false;
  for (const auto& row : json["rows"]) {
    EXPECT_LE(row["n"].get<int>(), 2) << row;
    if (row["metric"] != "task_time" || row["minus"] != "x") continue;
    compared = true;
    EXPECT_NEAR(row["mean"].get<double>(), 1, 0.01) << "one waited a second longer";
    EXPECT_NEAR(row["half_width"].get<double>(), 0, 1e-9);
    EXPECT_EQ(row["n"], 2);
  }
  EXPECT_TRUE(compared);
  ASSERT_EQ(json["recordings"].size(), 5u);
  EXPECT_EQ(json["recordings"][0]["whole"], true);
  EXPECT_EQ(json["recordings"][4]["whole"], false);
  EXPECT_EQ(json["recordings"][4]["flaws"].size(), 1u);
  const std::string csv = test::content(folder_.file("o.csv"));
  EXPECT_TRUE(test::begins(csv, "file,participant,input,condition,task,"));
  EXPECT_TRUE(test::says(csv, ",whole\n"));
  EXPECT_TRUE(csv.ends_with(",0\n")) << csv;
}

TEST_F(OperatorsCommand, RefusesBadInputInOneLine) {
  const auto expect_refused = [&](const std::vector<std::string>& more, const std::string& said) {
    const auto result = run(more);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(test::says(result.err, said));
  };
  expect_refused({}, "plan.toml");
  write_plan(planned("missing.mcap", "a", "x"));
  expect_refused({}, "missing.mcap");
  expect_refused({"--by", "taste"}, "must be condition or input");
  expect_refused({"--json", folder_.file("missing.mcap")}, "missing.mcap");
  std::ofstream(folder_.file("missing.mcap")) << "no recording";
  expect_refused({}, "missing.mcap");
  recording::Head head;
  head.program = "knuckle import";
  head.imported = head.has_machine = head.virtual_time = true;
  mcap::FileWriter file;
  ASSERT_TRUE(file.open(folder_.file("table.mcap"), recording::topics()) && file.note(recording::metadata_of(head)) &&
              file.close());
  write_plan(planned("table.mcap", "a", "x"));
  expect_refused({}, "table.mcap: was imported from a table");
}

}  // namespace
}  // namespace knuckle::operators
