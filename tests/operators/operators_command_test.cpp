// The command as it is run.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "recording/mcap/file_writer.h"
#include "recording/topics.h"
#include "tests/operators/recorded_sessions.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
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
    return test::run_program(test::program("knuckle-studies"), arguments);
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

TEST_F(OperatorsCommand, MakesOneTableOfSeveralRecordings) {
  test::record(waiting(1), folder_.file("short.mcap"));
  test::record(waiting(2), folder_.file("long.mcap"));
  write_plan(planned("short.mcap", "a", "x") + planned("long.mcap", "a", "y") +
             planned("../" + folder_.path().filename().string() + "/other.mcap", "b", "x") +
             planned("other_long.mcap", "b", "y"));
  std::filesystem::copy(folder_.file("short.mcap"), folder_.file("other.mcap"));
  std::filesystem::copy(folder_.file("long.mcap"), folder_.file("other_long.mcap"));
  const auto result = run({"--json", folder_.file("o.json"), "--csv", folder_.file("o.csv")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("task reach: means over participants"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("y - x"), std::string::npos) << result.out;
  const auto json = nlohmann::json::parse(test::content(folder_.file("o.json")));
  for (const auto& row : json["rows"]) {
    if (row["metric"] != "task_time" || row["minus"] != "x") continue;
    EXPECT_NEAR(row["mean"].get<double>(), 1, 0.01) << "one waited a second longer";
    EXPECT_NEAR(row["half_width"].get<double>(), 0, 1e-9);
    EXPECT_EQ(row["n"], 2);
  }
  EXPECT_EQ(test::content(folder_.file("o.csv")).substr(0, 38), "file,participant,input,condition,task,");
}

TEST_F(OperatorsCommand, CountsNoTrialThatIsCutOffAndSaysSo) {
  const std::string whole = folder_.file("whole.mcap"), cut = folder_.file("cut.mcap");
  test::record(waiting(3), whole);
  std::filesystem::copy(whole, cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) * 6 / 10);
  write_plan(planned("whole.mcap", "a", "x") + planned("cut.mcap", "b", "x"));
  const auto result = run({"--json", folder_.file("o.json"), "--csv", folder_.file("o.csv")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("; it has no end: its program was killed, or the disk refused the rest\n"),
            std::string::npos)
      << result.err;
  EXPECT_EQ(result.err.find(whole), std::string::npos) << result.err;
  EXPECT_NE(result.out.find("Left out of all means, as these recordings are not whole:\n  b, x, task reach: " + cut),
            std::string::npos)
      << result.out;
  const auto json = nlohmann::json::parse(test::content(folder_.file("o.json")));
  ASSERT_EQ(json["recordings"].size(), 2u);
  const auto &kept = json["recordings"][0], &left_out = json["recordings"][1];
  EXPECT_EQ(kept["whole"], true);
  EXPECT_TRUE(kept["flaws"].empty());
  EXPECT_EQ(left_out["whole"], false);
  ASSERT_EQ(left_out["flaws"].size(), 1u) << left_out["flaws"];
  EXPECT_NE(std::string(left_out["flaws"][0]).find(": cut off: "), std::string::npos) << left_out["flaws"];
  EXPECT_LT(left_out["metrics"]["task_time"], kept["metrics"]["task_time"]);
  for (const auto& row : json["rows"]) EXPECT_EQ(row["n"], 1) << row;
  const std::string csv = test::content(folder_.file("o.csv"));
  EXPECT_NE(csv.find(",whole\n"), std::string::npos);
  EXPECT_TRUE(csv.ends_with(",0\n")) << csv;
}

TEST_F(OperatorsCommand, RefusesAnImportedTable) {
  recording::Head head;
  head.program = "knuckle import";
  head.imported = head.has_machine = head.virtual_time = true;
  mcap::FileWriter file;
  std::string path = folder_.file("table.mcap");
  ASSERT_TRUE(file.open(path, recording::topics()) && file.note(recording::metadata_of(head)) && file.close());
  write_plan(planned("table.mcap", "a", "x"));
  const auto result = run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("table.mcap: was imported from a table"), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST_F(OperatorsCommand, RefusesBadInputInOneLine) {
  const auto refusal = [&](const std::vector<std::string>& more) {
    const auto result = run(more);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  EXPECT_NE(refusal({}).find("plan.toml"), std::string::npos);
  write_plan(planned("missing.mcap", "a", "x"));
  EXPECT_NE(refusal({}).find("missing.mcap"), std::string::npos);
  EXPECT_NE(refusal({"--by", "taste"}).find("must be condition or input"), std::string::npos);
  EXPECT_NE(refusal({"--json", folder_.file("missing.mcap")}).find("missing.mcap"), std::string::npos);
  std::ofstream(folder_.file("missing.mcap")) << "no recording";
  EXPECT_NE(refusal({}).find("missing.mcap"), std::string::npos);
}

}  // namespace
}  // namespace knuckle::operators
