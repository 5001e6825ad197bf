// Recordings for the player's tests: those of tests/recordings_replayed, whole and with something left out.
#pragma once

#include <fstream>
#include <string>

#include "app/console/console_loop.h"
#include "app/console/player/load.h"
#include "app/session/session_setup.h"
#include "master/master_state.h"
#include "recording/fields.h"
#include "recording/recorder.h"
#include "slave/slave_state.h"
#include "tests/recording/rewrite.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

inline std::string recorded(const std::string& name) {
  return source_dir() + "/tests/recordings_replayed/" + name + ".mcap";
}

inline recording::Head head_of(const std::string& file) {
  return recording::Recording({file}).head();
}

/// A copy with another head, or with messages changed or left out. @return the new file.
inline std::string edited(
    const TemporaryFolder& folder, const std::string& name, const recording::Head& head,
    const EditMessage& edit = [](const std::string&, std::vector<std::uint8_t>&) { return true; }) {
  const std::string file = folder.file(name + "_" + std::to_string(folder.count()) + ".mcap");
  rewrite(recorded(name), file, head, {1}, edit);
  return file;
}
inline std::string edited(const TemporaryFolder& folder, const std::string& name, const EditMessage& edit) {
  return edited(folder, name, head_of(recorded(name)), edit);
}

/// One side of it, as a program that has only this one records. @return the new file.
inline std::string one_side(const TemporaryFolder& folder, const std::string& name, bool operator_side) {
  recording::Head head = head_of(recorded(name));
  head.has_operator = operator_side;
  head.has_machine = !operator_side;
  return edited(folder, name, head, [&](const std::string& topic, std::vector<std::uint8_t>&) {
    return topic.rfind(operator_side ? "/machine/" : "/operator/", 0) != 0;
  });
}

/// Without the steps of either side for which missing(operator_side, at) says so. @return the new file.
template <typename Missing>
std::string with_holes(const TemporaryFolder& folder, const std::string& name, const Missing& missing) {
  return edited(folder, name, [&](const std::string& topic, std::vector<std::uint8_t>& message) {
    const bool operator_side = topic.starts_with("/operator/");
    master::MasterState mine;
    slave::SlaveState its;
    if (topic == "/operator/state" && recording::decode(message, mine)) return !missing(true, mine.at);
    if (topic == "/machine/state" && recording::decode(message, its)) return !missing(false, its.at);
    const auto wires = topic.ends_with("/wires") ? recording::decode_wires(message, kLinkVersion) : std::nullopt;
    return !wires || !missing(operator_side, wires->at);
  });
}

/// Its machine file with another gain, for its loops to run again with. @return the new file.
inline std::string slower_machine(const TemporaryFolder& folder, const std::string& name) {
  std::string machine = head_of(recorded(name)).machine_file;
  const std::string gain = "\nposition_gain_1ps = 3";
  machine.replace(machine.find(gain), gain.size(), "\nposition_gain_1ps = 1");
  const std::string file = folder.file("slow.toml");
  std::ofstream(file) << machine;
  return file;
}

/// Six seconds of a session that its scenario leads over a link that loses and delays, looked at while it is recorded.
/// @param look called after every millisecond. @return the file.
template <typename Look>
std::string recorded_live(const TemporaryFolder& folder, const Look& look) {
  session::SimulateOptions options;
  options.scenario = "free_motion";
  options.loss = 0.05;
  options.delay_ms = options.jitter_ms = 8;
  const session::SessionSetup setup = session::load_session(options).setup;
  recording::RecorderOptions how;
  how.file = folder.file("live.mcap");
  recording::Head head = session::session_head(setup, options);
  head.far_end_is_this_machine = false;
  recording::Recorder recorder(how, head, setup.machine);
  console::LiveSession live(setup, console::LiveSession::Led::kByScenario, nullptr);
  live.record_to(recorder);
  for (int tick = 1; tick <= 6000; ++tick) {
    live.step({});
    if (tick % 50 == 0) recorder.drain();
    look(tick, live);
  }
  recorder.close();
  return how.file;
}

/// Calls take(state) for every state of this kind in a file.
template <typename State, typename Take>
void for_each_state(const std::string& file, recording::Topic topic, const Take& take) {
  recording::Recording recording({file});
  while (const auto entry = recording.next()) {
    if (entry->topic != topic) continue;
    State state;
    if (!recording::decode(entry->data, state)) throw std::runtime_error(file + ": no state of this version");
    take(state);
  }
}

}  // namespace knuckle::test
