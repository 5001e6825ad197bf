// Batteries of sessions by the programs: however the work is shared out, the result is the same to the bit; one session
// of it runs again alone; wrong usage is one line.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::studies {
namespace {

using test::content;
using test::ProgramRun;
using test::run_program;
using Arguments = std::vector<std::string>;

class SweepProgram : public testing::Test {
 protected:
  static constexpr int kSessions = 3;

  /// On one processor unless it says otherwise: real-time tests run beside it.
  [[nodiscard]] static ProgramRun sweep(Arguments more) { return battery(kSessions, std::move(more)); }
  [[nodiscard]] static ProgramRun battery(int sessions, Arguments more) {
    Arguments all{"sweep", "--battery", "feel", "--sessions", std::to_string(sessions)};
    all.insert(all.end(), more.begin(), more.end());
    if (std::find(all.begin(), all.end(), "--jobs") == all.end()) all.insert(all.end(), {"--jobs", "1"});
    return run_program(test::program("knuckle-studies"), all);
  }
  /// The result of one process and one thread.
  const std::string& whole() {
    if (whole_.empty()) {
      const ProgramRun run = sweep({"--jobs", "1", "--json", folder_.file("whole.json")});
      EXPECT_EQ(run.exit_code, 0) << run.err;
      whole_ = content(folder_.file("whole.json"));
    }
    return whole_;
  }
  /// The result of one session.
  std::string single(Arguments more = {}) {
    const std::string file = folder_.file("single.json");
    more.insert(more.end(), {"--json", file});
    const ProgramRun run = battery(1, std::move(more));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return content(file);
  }
  void expect_same(const ProgramRun& run, const std::string& file) {
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(content(folder_.file(file)), whole());
  }
  void expect_refused(const ProgramRun& run, const std::string& why) {
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_NE(run.err.find(why), std::string::npos) << run.err;
  }

  test::TemporaryFolder folder_;
  std::string whole_;
};

TEST_F(SweepProgram, IsTheSameOnAnyNumberOfThreadsAndInShards) {
  const auto json = nlohmann::json::parse(whole());
  ASSERT_EQ(json["rows"].size(), std::size_t(kSessions));
  EXPECT_EQ(json["groups"][0]["refused"], 0);
  expect_same(sweep({"--jobs", "3", "--json", folder_.file("threads.json")}), "threads.json");
  for (const char* shard : {"1/2", "2/2"}) {
    const std::string rows = folder_.file(std::string("rows") + shard[0]);
    EXPECT_EQ(sweep({"--shard", shard, "--rows", rows}).exit_code, 0);
  }
  expect_same(sweep({"--merge", folder_.file("rows1"), folder_.file("rows2"), "--json", folder_.file("merged.json")}),
              "merged.json");
}

TEST_F(SweepProgram, IsTakenUpWhereItEnded) {
  const std::string rows = folder_.file("rows");
  ASSERT_EQ(sweep({"--jobs", "1", "--rows", rows}).exit_code, 0);
  std::string text = content(rows);
  for (int line = 0; line < 3; ++line) text.resize(text.rfind('\n'));  // two rows less, and the line end before
  std::ofstream(rows, std::ios::trunc) << text << "\n{\"cell\":2,\"dra";
  expect_same(sweep({"--rows", rows, "--json", folder_.file("resumed.json")}), "resumed.json");
}

#ifdef KNUCKLE_MPI
TEST_F(SweepProgram, IsTheSameUnderMpi) {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  const ProgramRun run =
      run_program("mpirun", {"--oversubscribe", "-n", "2", test::program("knuckle-studies"), "sweep", "--battery",
                             "feel", "--sessions", std::to_string(kSessions), "--jobs", "1", "--rows",
                             folder_.file("rows"), "--json", folder_.file("mpi.json")});
  expect_same(run, "mpi.json");
  // Two ranks shared it: had each run alone, either file would have all rows.
  const auto rows = [&](const char* file) {
    const std::string text = content(folder_.file(file));
    return std::count(text.begin(), text.end(), '\n') - 1;
  };
  EXPECT_EQ(rows("rows.0"), 2);
  EXPECT_EQ(rows("rows.1"), 1);
  // One process takes up what two have left.
  expect_same(sweep({"--rows", folder_.file("rows"), "--json", folder_.file("one.json")}), "one.json");
  EXPECT_EQ(rows("rows"), 0);
}
#endif

TEST_F(SweepProgram, OneSessionRunsAgainAloneAndSaysWhereItIsNoLongerTheSame) {
  auto json = nlohmann::ordered_json::parse(whole());
  json["rows"][1]["digest"] = "of another build";
  std::ofstream(folder_.file("other.json")) << json;
  const auto again = [&](const char* cell) {
    const ProgramRun run = run_program(
        test::program("knuckle"), {"simulate", "--from-cell", folder_.file(cell), "--json", folder_.file("cell.json")});
    EXPECT_LE(run.exit_code, 1) << run.err;
    return run.out;
  };
  EXPECT_NE(again("other.json:1").find("this is not the session that the battery ran"), std::string::npos);
  EXPECT_EQ(again("whole.json:2").find("this is not the session"), std::string::npos);
  const auto cell = nlohmann::json::parse(content(folder_.file("cell.json")));
  EXPECT_EQ(cell["digest"], json["rows"][2]["digest"]);
}

TEST_F(SweepProgram, RowsThatContradictEachOtherAreRefused) {
  const std::string rows = folder_.file("rows"), other = folder_.file("other");
  (void)single({"--rows", rows});
  std::string text = content(rows);
  const std::size_t digest = text.rfind("\"digest\":\"") + 10;
  text[digest] = text[digest] == '0' ? '1' : '0';
  std::ofstream(other) << text;
  expect_refused(battery(1, {"--merge", rows, other}), "differs from a row of the same cell");
}

TEST_F(SweepProgram, WorkRunsStockScenariosAndEachIsTheSameInAShard) {
  const auto work = [&](Arguments more) {
    Arguments all{"sweep", "--battery", "work", "--sessions", "2", "--jobs", "1"};
    all.insert(all.end(), more.begin(), more.end());
    const ProgramRun run = run_program(test::program("knuckle-studies"), all);
    EXPECT_EQ(run.exit_code, 0) << run.err;
  };
  work({"--json", folder_.file("work.json")});
  const auto json = nlohmann::ordered_json::parse(content(folder_.file("work.json")));
  ASSERT_EQ(json["rows"].size(), 2U);
  for (const auto& row : json["rows"]) {
    EXPECT_FALSE(row["metrics"].empty()) << row;
    const std::string scenario = row["drawn"].value("scenario", "none");
    EXPECT_TRUE(std::filesystem::exists(test::source_dir() + "/config/scenarios/" + scenario + ".toml"))
        << row["drawn"];
  }

  work({"--shard", "2/2", "--rows", folder_.file("rows")});
  const std::string rows = content(folder_.file("rows"));
  EXPECT_EQ(rows.substr(rows.find('\n') + 1), json["rows"][1].dump() + '\n') << "behind the head, its only row";
}

/// One machine takes a quarter of a minute: the row of the second is the first one's under its seed.
TEST_F(SweepProgram, EstimationIsJudgedOnceAllMachinesAreThereFromTheirRowsAlone) {
  const auto estimation = [&](Arguments more) {
    Arguments all{"sweep", "--battery", "estimation", "--machines", "2", "--ensemble", "0", "--jobs", "1"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(test::program("knuckle-studies"), all);
  };
  const std::string first = folder_.file("first"), second = folder_.file("second");
  ASSERT_EQ(estimation({"--shard", "1/2", "--rows", first, "--json", folder_.file("half.json")}).exit_code, 0)
      << "half of it has no verdict";
  const auto half = nlohmann::json::parse(content(folder_.file("half.json")));
  EXPECT_EQ(half["judged"], 1);
  EXPECT_TRUE(half["passed"].is_null());
  std::istringstream lines(content(first));
  std::string head, line;
  std::getline(lines, head);
  std::getline(lines, line);
  auto row = nlohmann::ordered_json::parse(line);
  row["cell"] = 1;
  std::ofstream(second) << head << '\n' << row << '\n';
  expect_refused(estimation({"--merge", first, second}), ":2: is no row of this battery");
  row["seed"] = row["seed"].get<std::uint64_t>() + 1;
  std::ofstream(second) << head << '\n' << row << '\n';
  const ProgramRun merged = estimation({"--merge", first, second, "--json", folder_.file("merged.json")});
  ASSERT_LE(merged.exit_code, 1) << merged.err;
  const std::string json = content(folder_.file("merged.json"));
  EXPECT_EQ(nlohmann::json::parse(json)["judged"], 2);
  EXPECT_EQ(nlohmann::json::parse(json)["passed"], merged.exit_code == 0);
  const ProgramRun again = estimation({"--rows", second, "--merge", first, "--json", folder_.file("again.json")});
  EXPECT_EQ(again.exit_code, merged.exit_code);
  EXPECT_EQ(content(folder_.file("again.json")), json);
}

TEST_F(SweepProgram, WritesATableAndAPage) {
  const ProgramRun run = sweep({"--csv", folder_.file("rows.csv"), "--report", folder_.file("page.html")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string csv = content(folder_.file("rows.csv")), page = content(folder_.file("page.html"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), kSessions + 1);
  EXPECT_NE(csv.find("stiffness_N_per_m"), std::string::npos);
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("stable and right"), std::string::npos);
}

TEST_F(SweepProgram, RefusesWhatDoesNotGoTogether) {
  expect_refused(sweep({"--shard", "0/2"}), "--shard 0/2: must be K/N");
  expect_refused(sweep({"--shard", "3/2"}), "--shard 3/2: must be K/N");
  expect_refused(sweep({"--machines", "3"}), "--machines: does not go with --battery feel");
  expect_refused(sweep({"--grid", "work"}), "is of the battery work");
  expect_refused(sweep({"--family", "rusty"}), "--family rusty: must be one of smooth, serviced, worn");
  const std::string foreign = folder_.file("foreign");
  std::ofstream(foreign) << "mine";
  expect_refused(sweep({"--rows", foreign}), "is not a file of a battery's rows");
  EXPECT_EQ(content(foreign), "mine");
  const auto simulate = [&](Arguments more) {
    more.insert(more.begin(), "simulate");
    return run_program(test::program("knuckle"), more);
  };
  expect_refused(sweep({"--rows", "/dev/null"}), "--rows /dev/null: must be a file");
  expect_refused(sweep({"--merge", folder_.path().string()}), "--merge " + folder_.path().string());
  expect_refused(sweep({"--rows", folder_.file("r"), "--json", folder_.file("r.0")}), "is kept for --rows");
  (void)single();
  const std::string file = folder_.file("single.json");
  expect_refused(simulate({"--from-cell", file + ":5"}), "sessions 0 to 0");
  expect_refused(simulate({"--from-cell", file}), "must be FILE:N");
  expect_refused(simulate({"--from-cell", file + ":0", "--seed", "3"}), "--seed: does not go with --from-cell");
  expect_refused(simulate({"--from-cell", foreign + ":1"}), "is not complete JSON");
  expect_refused(sweep({"--seed", "0"}), "--seed 0: must be a whole number from 1 to 1000000000");
}

TEST_F(SweepProgram, AResultThatWasEditedIsRefused) {
  const auto whole_result = nlohmann::ordered_json::parse(single());
  const auto edited = [&](const std::function<void(nlohmann::ordered_json&)>& edit) {
    auto json = whole_result;
    edit(json);
    const std::string file = folder_.file("edited.json");
    std::ofstream(file) << json;
    return run_program(test::program("knuckle"), {"simulate", "--from-cell", file + ":0"});
  };
  expect_refused(edited([](auto& json) { json["schema"] = 3; }), "is not a result of");
  expect_refused(edited([](auto& json) { json["settings"]["control"] = "tdpa"; }),
                 "settings: control = tdpa: must be echo, cues or direct");
  expect_refused(edited([](auto& json) { json.erase("schema"); }), "is not a result of");
  expect_refused(edited([](auto& json) { json["settings"]["seed"] = -1; }), "seed = -1: must be 1 or more");
  expect_refused(edited([](auto& json) { json["settings"]["sessions"] = 0; }), "sessions = 0: must be 1 or more");
  expect_refused(edited([](auto& json) { json["settings"]["loss"] = {1.5}; }),
                 "edited.json: settings: loss = 1.5: must be within [0, 1]");
  expect_refused(edited([](auto& json) { json["settings"]["rtt_ms"] = nlohmann::json::array(); }),
                 "settings: rtt_ms = []: must have at least one value");
  expect_refused(edited([](auto& json) {
                   json["settings"]["felt_N"] = {3, 2};
                 }),
                 "felt_N = [3,2]: must be [low, high]");
  expect_refused(edited([](auto& json) {
                   json["settings"]["speed_mps"] = {0.1, 2};
                 }),
                 "speed_mps = 2: must be within [0.01, 1]");
  expect_refused(edited([](auto& json) {
                   json["settings"]["commissioned"] = {{{"file", "out/mine.toml"}, {"seed", 1}}};
                 }),
                 "settings: machine = out/mine.toml: is not there: run this in the folder in which the battery ran");
  expect_refused(edited([](auto& json) { json["rows"].erase(0); }), "rows: has none of session 0");
  expect_refused(edited([](auto& json) { json["rows"] = "none"; }), "rows: has none of session 0");
  expect_refused(edited([](auto& json) { json["rows"][0].erase("digest"); }), "rows: has none of session 0");
}

TEST_F(SweepProgram, ADamagedRowIsRefused) {
  const std::string rows = folder_.file("rows");
  (void)single({"--rows", rows});
  const std::string kept = content(rows);
  const std::size_t value = kept.find("\"metrics\":{") + 11;
  const std::size_t colon = kept.find(':', value);
  std::ofstream(rows) << kept.substr(0, colon + 1) << "\"" << kept.substr(colon + 1, kept.find(',', colon) - colon - 1)
                      << "\"" << kept.substr(kept.find(',', colon));
  expect_refused(battery(1, {"--rows", rows}), ":2: is no row of this battery");
}

TEST_F(SweepProgram, AScenarioThatNeedsARecordingIsRefusedBeforeAnythingRuns) {
  const std::string grid = folder_.file("grid.toml");
  std::ofstream(grid) << content(test::source_dir() + "/config/grids/work.toml")
                      << "\n[[scenario]]\nname = \"recorded_dig\"\n";
  const ProgramRun run =
      run_program(test::program("knuckle-studies"), {"sweep", "--battery", "work", "--grid", grid, "--sessions", "1"});
  expect_refused(run, "recorded_dig.toml: follows a recording");
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

TEST_F(SweepProgram, InterruptedEndsInTheMidstOfAMachine) {
  expect_end_in_the_first_cell(folder_, {"--battery", "estimation", "--machines", "2", "--ensemble", "0"});
}

TEST_F(SweepProgram, InterruptedEndsInTheMidstOfTheEnsemble) {
  expect_end_in_the_first_cell(folder_, {"--battery", "estimation", "--machines", "2", "--ensemble", "2"});
}

}  // namespace
}  // namespace knuckle::studies
