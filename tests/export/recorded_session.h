// A short simulated session with its recording, made once for all tests of a binary; and what is in the recording,
// number by number, under the names that the states themselves have.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "app/recordings/state_table.h"
#include "master/master_state.h"
#include "recording/fields.h"
#include "recording/recording.h"
#include "slave/slave_state.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

struct RecordedSession {
  TemporaryFolder folder;
  std::string recording = folder.file("session.mcap"), candump = folder.file("session.log"),
              csv = folder.file("session.csv");

  RecordedSession() {
    const ProgramRun run =
        run_program(program("knuckle"), {"simulate", "--scenario", "wall_contact", "--duration", "1.5", "--log",
                                         recording, "--candump", candump, "--csv", csv});
    EXPECT_NE(run.exit_code, 2) << run.err;
  }
};

inline const RecordedSession& recorded_session() {
  static const RecordedSession session;
  return session;
}

/// One step: its numbers by name, "joint_rad[0]" and "fault.code" among them, in the order of the state.
using Numbers = std::vector<std::pair<std::string, double>>;

/// What nobody knows is NaN, as in all that is exported.
template <typename State>
[[nodiscard]] std::vector<Numbers> recorded_steps(const std::string& file) {
  const auto topic =
      std::is_same_v<State, slave::SlaveState> ? recording::Topic::kMachineState : recording::Topic::kOperatorState;
  recording::Recording recording({file});
  std::vector<Numbers> steps;
  while (const auto entry = recording.next()) {
    if (entry->topic != topic) continue;
    State state;
    recording::CdrReader in(entry->data);
    recording::get(in, state);
    recordings::show_unknown(state);
    Numbers& step = steps.emplace_back();
    recording::for_each_number("", state, [&step](const std::string& name, auto number) {
      step.emplace_back(name, static_cast<double>(number));
    });
  }
  return steps;
}

}  // namespace knuckle::test
