// Recordings for the player's tests: those of tests/recordings_replayed, whole and with something left out.
#pragma once

#include <string>

#include "app/console/player/load.h"
#include "recording/fields.h"
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
