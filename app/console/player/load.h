// Reads a recording, whole, into what the player holds of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/console/event_book.h"
#include "app/console/player/run.h"
#include "app/replay/replay_command.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "recording/head.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "sim/world.h"

namespace knuckle::console::player {

struct Played {
  std::string file;  ///< The first part.
  recording::Head head;
  MachineDescription machine;  ///< As calibrated; of the recording's attachments, as the next two.
  std::optional<DeviceDescription> device;
  std::optional<sim::WorldDescription> world;  ///< Of a simulated session, as at its start.
  Run run;
  /// In the order of their times: those that were recorded. Where the program recorded none, those that the console
  /// would have listed.
  std::vector<EventRow> events;
  std::vector<std::string> notes;  ///< What is wrong with the files; a line each.
};

/// @param files the parts of one recording, the first one first. @throws InputError, one line, where it cannot be read,
/// is of another version, or holds nothing to play.
[[nodiscard]] Played load(const std::vector<std::string>& files);

// A recorded session's loops run again with something changed, on what they had read: what they would have known and
// commanded at first, not what would have become of it (docs/recordings.md).

struct Rerun {
  Run run;
  recording::ReplayResult result;
};

/// @param recorded of the same files. @throws InputError as recording::replay() and replay::change() do.
[[nodiscard]] Rerun rerun(const std::vector<std::string>& files, const replay::Changes& changes, const Run& recorded);

}  // namespace knuckle::console::player
