// `knuckle simulate`: every output when the session is done, none when it is not.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "app/cli/interrupt.h"
#include "app/programs/programs.h"
#include "core/error.h"
#include "recording/recording.h"
#include "tests/session/synthetic_session.h"
#include "tests/support/forget_interrupts.h"
#include "tests/support/refusal.h"
#include "tests/support/run_inside.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::programs {
namespace {

using Folder = test::TemporaryFolder;
using test::content;

TEST(SimulateCommand, WritesEveryOutputWhenTheSessionIsDone) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  options.json = folder.file("a.json");
  options.candump = folder.file("a.log");
  const test::ProgramRun run = test::run_inside([&] {
    return simulate_command(options, "", [](const session::SimulateOptions&, const session::SessionHooks& hooks) {
      *hooks.candump << "(0.000000) can0 080#\n";
      return session::synthetic_session();
    });
  });
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_TRUE(test::says(run.out, "[hold_error_N]\nNOT passed"));
  EXPECT_EQ(folder.count(), 3);
  EXPECT_EQ(content(options.candump), "(0.000000) can0 080#\n");
}

TEST(SimulateCommand, ARecordingThatEndedTooEarlyIsAnErrorAndEverythingElseIsWritten) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  options.log = folder.file("a.mcap");
  const auto cut = [](const session::SimulateOptions&, const session::SessionHooks&) {
    session::SessionResult session = session::synthetic_session();
    session.log.problem = "No space left on device";
    return session;
  };
  const test::ProgramRun run = test::run_inside([&] {
    EXPECT_EQ(test::refusal([&] { return simulate_command(options, "", cut); }),
              "--log " + options.log + ": No space left on device");
    return 0;
  });
  EXPECT_TRUE(test::says(run.out, "hold_error_N"));
  EXPECT_EQ(folder.count(), 1) << "the table";
}

TEST(SimulateCommand, ASessionThatFailsOrIsInterruptedLeavesNoOutput) {
  const test::ForgetInterrupts afterwards;
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  const auto failing = [](const session::SimulateOptions&, const session::SessionHooks&) -> session::SessionResult {
    throw InputError("bad");
  };
  EXPECT_THROW(simulate_command(options, "", failing), InputError);
  const auto interrupted = [](const session::SimulateOptions&, const session::SessionHooks& hooks) {
    std::raise(SIGINT);
    hooks.progress(0.5);
    return session::synthetic_session();
  };
  EXPECT_THROW(simulate_command(options, "", interrupted), cli::Interrupted);
  EXPECT_EQ(folder.count(), 0);
}

/// Interrupts a session when it looks for the `look`th time, each 2 s, after before() was called. @return what is said.
std::string interrupted_at(int look, const session::SimulateOptions& options, const std::function<void()>& before) {
  const test::ForgetInterrupts afterwards;
  int looks = 0;
  const auto interrupted = [&](const session::SimulateOptions& asked, const session::SessionHooks& hooks) {
    session::SessionHooks own = hooks;
    own.progress = [&](double done) {
      if (++looks == look) {
        before();
        std::raise(SIGINT);
      }
      hooks.progress(done);
    };
    return session::run_simulation(asked, own);
  };
  try {
    (void)simulate_command(options, "", interrupted);
  } catch (const cli::Interrupted& said) {
    return said.what();
  }
  return "was not interrupted";
}

TEST(SimulateCommand, CtrlCSaysWhereTheRecordingIs) {
  struct Case {
    bool of_before, realtime, taken_meanwhile;
  };
  for (const Case& c : {Case{false, false, false}, {true, false, false}, {true, true, false}, {false, false, true}}) {
    const Folder folder;
    session::SimulateOptions options;
    options.scenario = "free_motion";
    options.realtime = c.realtime;
    options.csv = folder.file("a.csv");
    options.log = folder.file("a.mcap");
    if (c.of_before) std::ofstream(options.log) << "of before";
    const std::string said = interrupted_at(3, options, [&] {
      if (c.taken_meanwhile) std::filesystem::create_directory(options.log);
    });
    const std::string kept = options.log + (c.of_before || c.taken_meanwhile ? ".partial" : "");
    const std::string why = c.taken_meanwhile ? "the recording has ended: Is a directory; " : "";
    EXPECT_EQ(said,
              "interrupted; " + why + "what was recorded until then is in " + kept + "; no other file was written");
    EXPECT_FALSE(std::filesystem::exists(options.csv));
    if (c.of_before) {
      EXPECT_EQ(content(options.log), "of before");
    }
    EXPECT_TRUE(std::filesystem::is_regular_file(kept));
    if (!c.taken_meanwhile) {
      EXPECT_TRUE(recording::Recording({kept}).complete());
    }
  }
}

TEST(SimulateCommand, CtrlCNamesTheFlightRecordsThatWereWritten) {
  const Folder folder;
  session::SimulateOptions options;
  options.scenario = "bus_faults";
  options.flights = folder.file("flights");
  const std::string said = interrupted_at(10, options, [] {});
  ASSERT_TRUE(std::filesystem::exists(options.flights));
  std::size_t named = 0;
  for (const auto& entry : std::filesystem::directory_iterator(options.flights)) {
    EXPECT_TRUE(test::says(said, "flight record: " + entry.path().string() + "; "));
    ++named;
  }
  EXPECT_GE(named, 1U);
  EXPECT_EQ(said.find("interrupted; flight record: "), 0U) << said;
  EXPECT_TRUE(said.ends_with("; no other file was written")) << said;
}

TEST(SimulateCommand, RefusesAFolderOfFlightRecordsThatCannotBeWritten) {
  const Folder folder;
  std::ofstream(folder.file("taken")) << "x";
  session::SimulateOptions options;
  options.scenario = "free_motion";
  for (const std::string& flights : {folder.file("taken"), folder.file("taken") + "/inside", std::string("/proc/x")}) {
    options.flights = flights;
    const std::string said = test::refusal([&] { return session::run_simulation(options, {}); });
    EXPECT_TRUE(said.starts_with("--flights " + flights + ": cannot be written: ")) << said;
  }
}

}  // namespace
}  // namespace knuckle::programs
