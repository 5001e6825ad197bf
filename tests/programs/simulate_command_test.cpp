// `knuckle simulate`: every output when the session is done, none when it is not.
#include "app/programs/simulate_command.h"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include "app/cli/interrupt.h"
#include "core/error.h"
#include "recording/recording.h"
#include "tests/session/synthetic_session.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::programs {
namespace {

using test::content;
using Folder = test::TemporaryFolder;

TEST(SimulateCommand, WritesEveryOutputWhenTheSessionIsDone) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  options.json = folder.file("a.json");
  options.candump = folder.file("a.log");
  testing::internal::CaptureStdout();
  const int code =
      simulate_command(options, "", [](const session::SimulateOptions&, const session::SessionHooks& hooks) {
        *hooks.candump << "(0.000000) can0 080#\n";
        return session::synthetic_session();
      });
  const std::string summary = testing::internal::GetCapturedStdout();
  EXPECT_EQ(code, 1);
  EXPECT_NE(summary.find("FAIL  hold_error_N"), std::string::npos) << summary;
  EXPECT_EQ(folder.count(), 3);
  EXPECT_EQ(content(options.candump), "(0.000000) can0 080#\n");
}

TEST(SimulateCommand, ASessionThatFailsLeavesNoOutput) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  const auto failing = [](const session::SimulateOptions&, const session::SessionHooks&) -> session::SessionResult {
    throw InputError("bad");
  };
  EXPECT_THROW(simulate_command(options, "", failing), InputError);
  EXPECT_EQ(folder.count(), 0);
}

TEST(SimulateCommand, CtrlCEndsTheSessionAndLeavesNoOutput) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  const auto interrupted = [](const session::SimulateOptions&, const session::SessionHooks& hooks) {
    std::raise(SIGINT);
    hooks.progress(0.5);
    return session::synthetic_session();
  };
  EXPECT_THROW(simulate_command(options, "", interrupted), cli::Interrupted);
  EXPECT_EQ(folder.count(), 0);
}

TEST(SimulateCommand, CtrlCSaysThatTheRecordingWasKept) {
  const Folder folder;
  session::SimulateOptions options;
  options.scenario = "free_motion";
  options.csv = folder.file("a.csv");
  options.log = folder.file("a.mcap");
  int looks = 0;
  const auto interrupted = [&looks](const session::SimulateOptions& asked, const session::SessionHooks& hooks) {
    session::SessionHooks own = hooks;
    own.progress = [&](double done) {
      if (++looks == 3) std::raise(SIGINT);
      hooks.progress(done);
    };
    return session::run_simulation(asked, own);
  };
  try {
    (void)simulate_command(options, "", interrupted);
    ADD_FAILURE() << "was not interrupted";
  } catch (const cli::Interrupted& said) {
    EXPECT_EQ(said.what(),
              "interrupted; what was recorded until then is in " + options.log + "; no other file was written");
  }
  EXPECT_EQ(folder.count(), 1);
  EXPECT_TRUE(recording::Recording({options.log}).complete());
}

TEST(SimulateCommand, RefusesAFolderOfFlightRecordsThatCannotBeWritten) {
  const Folder folder;
  std::ofstream(folder.file("taken")) << "x";
  session::SimulateOptions options;
  options.scenario = "free_motion";
  for (const std::string& flights : {folder.file("taken"), folder.file("taken") + "/inside", std::string("/proc/x")}) {
    options.flights = flights;
    try {
      (void)session::run_simulation(options, {});
      ADD_FAILURE() << flights << " was taken";
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find("--flights " + flights + ": cannot be written: "), 0U) << error.what();
    }
  }
}

}  // namespace
}  // namespace knuckle::programs
