// `knuckle import` as a user runs it, and what is made of a recording where a CSV was expected so far.
#include <gtest/gtest.h>

#include <cmath>

#include "recording/fields.h"
#include "recording/recording.h"
#include "slave/slave_state.h"
#include "tests/export/machines.h"
#include "tests/export/recorded_session.h"
#include "tests/export/run_export.h"
#include "tests/support/says.h"

namespace knuckle::exporting {
namespace {

using test::ProgramRun;
using test::run_knuckle;

/// A part of the session's own table, and the recording that is made of it.
struct ImportCommand : testing::Test {
  const test::TemporaryFolder folder;
  const std::string csv = folder.file("machine.csv"), mcap = folder.file("machine.mcap");

  ProgramRun import_part(const char* from_or_to, const char* seconds) const {
    const ProgramRun table = run_knuckle(
        {"export", test::recorded_session().recording, "--csv", csv, "--side", "machine", from_or_to, seconds});
    EXPECT_EQ(table.exit_code, 0) << table.err;
    return run_knuckle({"import", csv, "--machine", "solar015", "--out", mcap});
  }
};

TEST_F(ImportCommand, MakesARecordingThatIsExported) {
  const ProgramRun imported = import_part("--from", "0.3");
  EXPECT_EQ(imported.exit_code, 0) << imported.err;
  EXPECT_TRUE(test::says(imported.out, csv + ": 241 rows, 241 used"));
  const ProgramRun exported = run_knuckle({"export", mcap, "--csv", "-"});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_EQ(std::count(exported.out.begin(), exported.out.end(), '\n'), 242);
}

/// The first rows of a session, half of them before every sensor has been heard: zeros that nobody measured.
TEST_F(ImportCommand, RowsThatWereNotMeasuredAreHoles) {
  const ProgramRun imported = import_part("--to", "0.6");
  EXPECT_EQ(imported.exit_code, 0) << imported.err;
  EXPECT_TRUE(test::says(imported.out, " x not measured (not used): row 2"));
  EXPECT_FALSE(test::says(imported.out, "outside what is possible"));
  recording::Recording written({mcap}), original({test::recorded_session().recording});
  std::vector<slave::SlaveState> imported_states, states;
  const auto read = [](recording::Recording& from, std::vector<slave::SlaveState>& to) {
    while (const auto entry = from.next()) {
      if (entry->topic != recording::Topic::kMachineState) continue;
      ASSERT_TRUE(recording::decode(entry->data, to.emplace_back()));
    }
  };
  read(written, imported_states);
  read(original, states);
  ASSERT_GT(imported_states.size(), 40u);
  EXPECT_FALSE(states[0].measured);
  for (std::size_t i = 0; i < imported_states.size(); ++i) {
    ASSERT_EQ(imported_states[i].measured, states[i].measured) << i;
    if (states[i].measured) {
      EXPECT_NEAR(imported_states[i].cylinder_m[kBoom], states[i].cylinder_m[kBoom], 1e-9);
    } else {
      EXPECT_TRUE(std::isnan(imported_states[i].cylinder_m[kBoom])) << i;
    }
  }
}

TEST_F(ImportCommand, RefusesWithOneLine) {
  std::ofstream(csv) << "a,b\n1,2\n";
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"import", csv, "--machine", "solar015", "--out", mcap},
        {"import", csv, "--machine", "solar015", "--out", csv},
        {"import", test::recorded_session().recording, "--machine", "solar015", "--out", mcap},
        {"import", folder.file("none.csv"), "--machine", "solar015", "--out", mcap},
        {"import", csv, "--machine", "solar015", "--map", csv, "--out", mcap}}) {
    const ProgramRun refused = run_knuckle(arguments);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
  EXPECT_EQ(folder.count(), 1);
}

TEST_F(ImportCommand, SimulatedOperatorFollowsARecording) {
  const ProgramRun led = test::run_program(test::program("knuckle"),
                                           {"simulate", "--scenario", "recorded_dig", "--duration", "1", "--operator",
                                            "path:" + test::recorded_session().recording, "--json", "-"});
  EXPECT_NE(led.exit_code, 2) << led.err;
  EXPECT_NE(led.out.find("recorded in 1.5 s"), std::string::npos) << led.out.substr(0, 4000);
}

}  // namespace
}  // namespace knuckle::exporting
