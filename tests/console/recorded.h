// What is in a folder of recordings.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "recording/events.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "tests/recording/recorded_session.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

/// Paths of parts, or of flight records, the oldest first.
inline std::vector<std::string> recorded_in(const TemporaryFolder& folder, bool flights = false) {
  return paths_in(folder.path().string(), flights);
}

inline std::vector<recording::Event> events_of(const std::string& file) {
  recording::Recording recording({file});
  std::vector<recording::Event> events;
  while (const auto entry = recording.next())
    if (entry->topic == recording::Topic::kEvents)
      if (auto event = recording::decode_log(entry->data, recording.head().started_unix_ns))
        events.push_back(std::move(*event));
  return events;
}

/// The loops do the same again on what they read. @param steps of the operator's loop, at least.
inline void expect_identical(const std::string& file, std::uint64_t steps) {
  recording::Recording recording({file});
  const recording::ReplayResult result = recording::replay(recording, recording::setup_of(recording));
  EXPECT_TRUE(recording.complete()) << file;
  EXPECT_TRUE(recording.damages().empty()) << file;
  EXPECT_TRUE(result.identical()) << file;
  EXPECT_GE(result.sides[0].steps, steps) << file;
  EXPECT_EQ(result.sides[1].steps > 0, recording.head().has_machine) << file;
}

}  // namespace knuckle::test
