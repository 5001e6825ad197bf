// Recordings of simulated operators, for studies.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/session/session.h"
#include "app/session/session_head.h"
#include "app/session/session_setup.h"
#include "recording/recorder.h"

namespace knuckle::test {

/// Runs a scenario given as TOML. @param bookmarks are in it. @param change of the head, such as which side it has.
inline void record(const std::string& scenario, const std::string& file,
                   const std::vector<recording::Event>& bookmarks = {},
                   const std::function<void(recording::Head&)>& change = {}) {
  session::SimulateOptions options;
  options.scenario = "written_in_the_test";
  options.scenario_text = scenario;
  const session::SessionSetup setup = session::load_session(options).setup;
  recording::Head head = session::session_head(setup, options);
  if (change) change(head);
  recording::RecorderOptions how;
  how.file = file;
  how.compression = {1};
  recording::Recorder recorder(how, head, setup.machine);
  session::Session session(setup);
  session.record_to(recorder);
  for (int tick = 0; !session.done(); ++tick) {
    session.step();
    if (tick % 50 == 0) recorder.drain();
  }
  for (const recording::Event& bookmark : bookmarks) recorder.event(bookmark);
  recorder.close();
}

}  // namespace knuckle::test
