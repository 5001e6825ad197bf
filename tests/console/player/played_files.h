// Recordings for the player's tests: those of tests/recordings_replayed, whole and with something left out.
#pragma once

#include <string>

#include "app/console/player/load.h"
#include "master/master_state.h"
#include "recording/fields.h"
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

/// One side of it, as a program that has only this one records. @return the new file.
inline std::string one_side(const TemporaryFolder& folder, const std::string& name, bool operator_side) {
  recording::Head head = head_of(recorded(name));
  head.has_operator = operator_side;
  head.has_machine = !operator_side;
  const std::string file = folder.file(name + (operator_side ? "_operator" : "_machine") + ".mcap");
  rewrite(recorded(name), file, head, {1}, [&](const std::string& topic, std::vector<std::uint8_t>&) {
    return topic.rfind(operator_side ? "/machine/" : "/operator/", 0) != 0;
  });
  return file;
}

/// Without the steps of either side for which missing(operator_side, at) says so. @return the new file.
template <typename Missing>
std::string with_holes(const TemporaryFolder& folder, const std::string& name, const Missing& missing) {
  const std::string file = folder.file(name + "_holes.mcap");
  rewrite(recorded(name), file, head_of(recorded(name)), {1},
          [&](const std::string& topic, std::vector<std::uint8_t>& message) {
            const bool operator_side = topic.starts_with("/operator/");
            master::MasterState mine;
            slave::SlaveState its;
            if (topic == "/operator/state" && recording::decode(message, mine)) return !missing(true, mine.at);
            if (topic == "/machine/state" && recording::decode(message, its)) return !missing(false, its.at);
            const auto wires =
                topic.ends_with("/wires") ? recording::decode_wires(message, kLinkVersion) : std::nullopt;
            return !wires || !missing(operator_side, wires->at);
          });
  return file;
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
