// A session on virtual time that is recorded, and what comes of it.
#pragma once

#include <functional>
#include <string>

#include "app/session/session.h"
#include "app/session/session_head.h"
#include "app/session/session_setup.h"
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

/// Runs it to its end. @param each_tick called after every millisecond; may be empty.
inline recording::RecorderStatus record(const session::SimulateOptions& options, const recording::RecorderOptions& how,
                                        const std::function<void(session::Session&)>& each_tick = {}) {
  const session::LoadedSession loaded = session::load_session(options);
  recording::Recorder recorder(how, session::session_head(loaded.setup, options), loaded.setup.machine);
  session::Session session(loaded.setup);
  session.record_to(recorder);
  for (int tick = 0; !session.done(); ++tick) {
    session.step();
    if (each_tick) each_tick(session);
    if (tick % 50 == 0) recorder.drain();
  }
  recorder.close();
  return recorder.status();
}

[[nodiscard]] inline recording::ReplayResult replayed(const std::vector<std::string>& files) {
  recording::Recording recording(files);
  return recording::replay(recording, recording::setup_of(recording));
}

}  // namespace knuckle::test
