// A session on virtual time that is recorded, and what comes of it.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "app/session/session.h"
#include "app/session/session_setup.h"
#include "recording/file_names.h"
#include "recording/recorder.h"
#include "recording/recording.h"
#include "recording/replay.h"

namespace knuckle::test {

[[nodiscard]] inline session::SimulateOptions short_session(const std::string& scenario, double duration_s) {
  session::SimulateOptions options;
  options.scenario = scenario;
  options.duration_s = duration_s;
  return options;
}

/// A session and its recorder, before the first step.
struct RecordedSession {
  RecordedSession(const session::SimulateOptions& options, const recording::RecorderOptions& how)
      : RecordedSession(how, session::load_session(options).setup, options) {}

  /// To the session's end; the recorder takes what there is every 50 ms. @param each_tick called after every
  /// millisecond; may be empty.
  void run(const std::function<void(session::Session&)>& each_tick = {}) {
    for (int tick = 0; !session.done(); ++tick) {
      session.step();
      if (each_tick) each_tick(session);
      if (tick % 50 == 0) recorder.drain();
    }
  }

  recording::Recorder recorder;
  session::Session session;

 private:
  RecordedSession(const recording::RecorderOptions& how, const session::SessionSetup& setup,
                  const session::SimulateOptions& options)
      : recorder(how, session::session_head(setup, options), setup.machine), session(setup) {
    session.record_to(recorder);
  }
};

/// Runs it to its end and completes the recording. @param each_tick as above.
inline recording::RecorderStatus record(const session::SimulateOptions& options, const recording::RecorderOptions& how,
                                        const std::function<void(session::Session&)>& each_tick = {}) {
  RecordedSession recorded(options, how);
  recorded.run(each_tick);
  recorded.recorder.close();
  return recorded.recorder.status();
}

/// Into this folder, however full its disk is.
[[nodiscard]] inline recording::RecorderOptions into(const std::string& folder) {
  recording::RecorderOptions how;
  how.folder = folder;
  how.least_free_bytes = 0;
  return how;
}

/// Its recordings, or its flight records.
[[nodiscard]] inline std::vector<std::string> paths_in(const std::string& folder, bool flights) {
  std::vector<std::string> paths;
  for (const recording::FileOfFolder& file : recording::files_in(folder))
    if (file.flight == flights) paths.push_back(file.path);
  std::sort(paths.begin(), paths.end());
  return paths;
}

[[nodiscard]] inline recording::ReplayResult replayed(const std::vector<std::string>& files) {
  recording::Recording recording(files);
  return recording::replay(recording, recording::setup_of(recording));
}

}  // namespace knuckle::test
