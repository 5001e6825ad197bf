// A recorded session's loops run again with something changed, on what they had read: what they would have known and
// commanded at first, not what would have become of it (docs/recordings.md).
#pragma once

#include <string>
#include <vector>

#include "app/console/player/run.h"
#include "app/replay/replay_command.h"
#include "recording/replay.h"

namespace knuckle::console::player {

struct Rerun {
  Run run;
  recording::ReplayResult result;
};

/// @param recorded of the same files. @throws InputError as recording::replay() and replay::change() do.
[[nodiscard]] Rerun rerun(const std::vector<std::string>& files, const replay::Changes& changes, const Run& recorded);

}  // namespace knuckle::console::player
