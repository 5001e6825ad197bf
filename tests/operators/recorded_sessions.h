// Recordings of simulated operators, for studies.
#pragma once

#include <string>
#include <vector>

#include "tests/recording/recorded_session.h"

namespace knuckle::test {

/// Runs a scenario given as TOML. @param bookmarks are in it.
inline void record(const std::string& scenario, const std::string& file,
                   const std::vector<recording::Event>& bookmarks = {}) {
  session::SimulateOptions options;
  options.scenario = "written_in_the_test";
  options.scenario_text = scenario;
  recording::RecorderOptions how;
  how.file = file;
  how.compression = {1};
  RecordedSession recorded(options, how);
  recorded.run();
  for (const recording::Event& bookmark : bookmarks) recorded.recorder.event(bookmark);
  recorded.recorder.close();
}

}  // namespace knuckle::test
