// Batteries of sessions by the programs: however the work is shared out, the result is the same to the bit; one session
// of it runs again alone; wrong usage is one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::studies {
namespace {

using test::content;
using test::ProgramRun;
using test::run_program;
using test::says;
using Arguments = std::vector<std::string>;

class SweepProgram : public testing::Test {
 protected:
  static constexpr int kSessions = 2;

  /// On one processor unless it says otherwise: real-time tests run beside it.
  [[nodiscard]] static ProgramRun sweep(Arguments more) {
    Arguments all{"sweep", "--battery", "feel", "--sessions", std::to_string(kSessions)};
    all.insert(all.end(), more.begin(), more.end());
    if (std::find(all.begin(), all.end(), "--jobs") == all.end()) all.insert(all.end(), {"--jobs", "1"});
    return run_program(test::program("knuckle-studies"), all);
  }
  void expect_same(const ProgramRun& run, const std::string& file, const std::string& whole) {
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(content(folder_.file(file)), whole) << file;
  }
  void expect_refused(const ProgramRun& run, const std::string& why) {
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_TRUE(says(run.err, why));
  }

  test::TemporaryFolder folder_;
};

TEST_F(SweepProgram, IsTheSameOnAnyNumberOfThreadsInShardsAndTakenUpWhereItEnded) {
  const ProgramRun alone = sweep(
      {"--json", folder_.file("whole.json"), "--csv", folder_.file("rows.csv"), "--report", folder_.file("page.html")});
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  const std::string whole = content(folder_.file("whole.json")), csv = content(folder_.file("rows.csv"));
  const auto json = nlohmann::json::parse(whole);
  ASSERT_EQ(json["rows"].size(), std::size_t(kSessions));
  EXPECT_EQ(json["groups"][0]["refused"], 0);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), kSessions + 1);
  EXPECT_TRUE(says(csv, "stiffness_N_per_m"));
  EXPECT_TRUE(says(content(folder_.file("page.html")), "<svg"));

  expect_same(sweep({"--jobs", "2", "--json", folder_.file("threads.json")}), "threads.json", whole);

  const std::string rows = folder_.file("rows1"), others = folder_.file("rows2");
  ASSERT_EQ(sweep({"--shard", "1/2", "--rows", rows}).exit_code, 0);
  ASSERT_EQ(sweep({"--shard", "2/2", "--rows", others}).exit_code, 0);
  expect_same(sweep({"--merge", rows, others, "--json", folder_.file("merged.json")}), "merged.json", whole);

  const std::string first = content(rows), changed = folder_.file("changed");
  std::string other = first;
  const std::size_t digest = other.rfind("\"digest\":\"") + 10;
  other[digest] = other[digest] == '0' ? '1' : '0';
  std::ofstream(changed) << other;
  expect_refused(sweep({"--merge", rows, changed}), "differs from a row of the same cell");

  std::ofstream(changed) << first << "{\"cell\":1,\"dra";  // cut off
  expect_same(sweep({"--rows", changed, "--json", folder_.file("resumed.json")}), "resumed.json", whole);

  std::string damaged = first;
  const std::size_t value = damaged.find(':', damaged.find("\"metrics\":{") + 11) + 1;
  damaged.insert(damaged.find(',', value), "\"").insert(value, "\"");
  std::ofstream(changed) << damaged;
  expect_refused(sweep({"--rows", changed}), ":2: is no row of this battery");
}

#ifdef KNUCKLE_MPI
TEST_F(SweepProgram, IsTheSameUnderMpi) {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  const ProgramRun run =
      run_program("mpirun", {"--oversubscribe", "-n", "2", test::program("knuckle-studies"), "sweep", "--battery",
                             "feel", "--sessions", std::to_string(kSessions), "--jobs", "1", "--rows",
                             folder_.file("rows"), "--json", folder_.file("mpi.json")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // Two ranks shared it: had each run alone, either file would have all rows.
  const auto rows = [&](const char* file) {
    const std::string text = content(folder_.file(file));
    return std::count(text.begin(), text.end(), '\n') - 1;
  };
  EXPECT_EQ(rows("rows.0"), 1);
  EXPECT_EQ(rows("rows.1"), 1);
  // One process takes up what two have left.
  const std::string whole = content(folder_.file("mpi.json"));
  expect_same(sweep({"--rows", folder_.file("rows"), "--json", folder_.file("one.json")}), "one.json", whole);
  EXPECT_EQ(rows("rows"), 0);
  expect_same(sweep({"--json", folder_.file("alone.json")}), "alone.json", whole);
}
#endif

TEST_F(SweepProgram, OneSessionRunsAgainAloneAndSaysWhereItIsNoLongerTheSame) {
  ASSERT_EQ(sweep({"--json", folder_.file("whole.json")}).exit_code, 0);
  auto json = nlohmann::ordered_json::parse(content(folder_.file("whole.json")));
  json["rows"][0]["digest"] = "of another build";
  std::ofstream(folder_.file("other.json")) << json;
  const auto again = [&](const char* cell, Arguments more = {}) {
    more.insert(more.begin(), {"simulate", "--from-cell", folder_.file(cell), "--json", folder_.file("cell.json")});
    return run_program(test::program("knuckle"), more);
  };
  EXPECT_TRUE(says(again("other.json:0").out, "this is not the session that the battery ran"));
  const ProgramRun same = again("whole.json:1");
  EXPECT_LE(same.exit_code, 1) << same.err;
  EXPECT_FALSE(says(same.out, "this is not the session"));
  EXPECT_EQ(nlohmann::json::parse(content(folder_.file("cell.json")))["digest"], json["rows"][1]["digest"]);
  expect_refused(again("whole.json:0", {"--seed", "3"}), "--seed: does not go with --from-cell");
}

/// Rows of two machines made by hand, for a machine takes a quarter of a minute.
TEST_F(SweepProgram, EstimationIsJudgedOnceAllMachinesAreThereFromTheirRowsAlone) {
  const auto estimation = [&](Arguments more) {
    Arguments all{"sweep", "--battery", "estimation", "--machines", "2", "--ensemble", "0", "--jobs", "1"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(test::program("knuckle-studies"), all);
  };
  const std::string first = folder_.file("first"), second = folder_.file("second");
  ASSERT_EQ(estimation({"--shard", "3/3", "--rows", first}).exit_code, 0) << "a shard without a machine";
  const std::string head = content(first);
  constexpr std::uint64_t kFirstSeed = 1'000'000'007;
  nlohmann::ordered_json row, method;
  method["method"] = "full";
  method["identified"] = method["usable"] = true;
  method["metrics"]["slow_rms_N"] = 20;
  row["cell"] = 0;
  row["seed"] = kFirstSeed;
  row["commissioning"] = nlohmann::ordered_json::object();
  row["methods"].push_back(method);
  std::ofstream(first) << head << row << '\n';
  ASSERT_EQ(estimation({"--shard", "1/2", "--rows", first, "--json", folder_.file("half.json")}).exit_code, 0)
      << "half of it has no verdict";
  const auto half = nlohmann::json::parse(content(folder_.file("half.json")));
  EXPECT_EQ(half["judged"], 1);
  EXPECT_TRUE(half["passed"].is_null());
  row["cell"] = 1;
  std::ofstream(second) << head << row << '\n';
  expect_refused(estimation({"--merge", first, second}), ":2: is no row of this battery");
  row["seed"] = kFirstSeed + 1;
  std::ofstream(second) << head << row << '\n';
  const ProgramRun merged = estimation({"--merge", first, second, "--json", folder_.file("merged.json")});
  ASSERT_LE(merged.exit_code, 1) << merged.err;
  const std::string json = content(folder_.file("merged.json"));
  EXPECT_EQ(nlohmann::json::parse(json)["judged"], 2);
  EXPECT_EQ(nlohmann::json::parse(json)["passed"], merged.exit_code == 0);
  const ProgramRun again = estimation({"--rows", second, "--merge", first, "--json", folder_.file("again.json")});
  EXPECT_EQ(again.exit_code, merged.exit_code);
  EXPECT_EQ(content(folder_.file("again.json")), json);
}

TEST_F(SweepProgram, RefusesWhatDoesNotGoTogetherBeforeAnythingRuns) {
  const std::string foreign = folder_.file("foreign"), grid = folder_.file("grid.toml");
  std::ofstream(foreign) << "mine";
  std::ofstream(grid) << content(test::source_dir() + "/config/grids/work.toml")
                      << "\n[[scenario]]\nname = \"recorded_dig\"\n";
  for (const auto& [arguments, said] : std::vector<std::pair<Arguments, std::string>>{
           {{"--shard", "0/2"}, "--shard 0/2: must be K/N"},
           {{"--shard", "3/2"}, "--shard 3/2: must be K/N"},
           {{"--machines", "3"}, "--machines: does not go with --battery feel"},
           {{"--grid", "work"}, "is of the battery work"},
           {{"--family", "rusty"}, "--family rusty: must be one of smooth, serviced, worn"},
           {{"--rows", foreign}, "is not a file of a battery's rows"},
           {{"--merge", folder_.path().string()}, "--merge " + folder_.path().string()},
           {{"--rows", folder_.file("r"), "--json", folder_.file("r.0")}, "is kept for --rows"},
           {{"--seed", "0"}, "--seed 0: must be a whole number from 1 to 1000000000"}})
    expect_refused(sweep(arguments), said);
  EXPECT_EQ(content(foreign), "mine");
  expect_refused(
      run_program(test::program("knuckle-studies"), {"sweep", "--battery", "work", "--grid", grid, "--sessions", "1"}),
      "recorded_dig.toml: follows a recording");
}

/// The first cell takes far longer than reading the options: its row is there only if somebody waits for it.
void expect_end_in_the_first_cell(const test::TemporaryFolder& folder, const Arguments& battery) {
  const std::string rows = folder.file("rows");
  Arguments arguments{"sweep", "--jobs", "1", "--rows", rows, "--json", folder.file("out.json")};
  arguments.insert(arguments.end(), battery.begin(), battery.end());
  test::RunningProgram program(test::program("knuckle-studies"), arguments);
  while (!std::filesystem::exists(rows) && !program.ends_within(std::chrono::seconds(0))) {
  }
  EXPECT_TRUE(program.interrupt_when_it_listens());
  const ProgramRun run = program.wait();
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_EQ(run.err, "knuckle-studies: interrupted; 0 of 2 cells are kept: the same command runs the others\n");
  const std::string kept = content(rows);
  EXPECT_EQ(std::count(kept.begin(), kept.end(), '\n'), 1) << "the head and no row";
  EXPECT_EQ(folder.count(), 1) << "no part of --json";
}

TEST_F(SweepProgram, InterruptedEndsInTheMidstOfASession) {
  expect_end_in_the_first_cell(folder_, {"--battery", "work", "--sessions", "2"});
}

TEST_F(SweepProgram, InterruptedEndsInTheMidstOfAMachineAndOfTheEnsemble) {
  for (const char* ensemble : {"0", "2"}) {
    SCOPED_TRACE(ensemble);
    const test::TemporaryFolder folder;
    expect_end_in_the_first_cell(folder, {"--battery", "estimation", "--machines", "2", "--ensemble", ensemble});
  }
}

}  // namespace
}  // namespace knuckle::studies
