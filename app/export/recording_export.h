// A recording as files for other tools, all in one pass.
#pragma once

#include <functional>
#include <optional>
#include <ostream>

#include "app/cli/output_file.h"
#include "core/time.h"
#include "recording/camera_picture.h"
#include "recording/recording.h"
#include "recording/replay.h"

namespace knuckle::exporting {

struct RecordingOutputs {
  std::ostream* csv = nullptr;  ///< A row a step of this side.
  recording::Side side{};
  cli::OutputFile* hdf5 = nullptr;
  std::function<void(const recording::CameraPicture&)> picture;  ///< Called for each, in their order.
  std::ostream* candump = nullptr;                               ///< The frames that crossed, in candump's log format.
  std::function<void()> check;                                   ///< Called all the time; may throw to end it.
  Time from{}, to = Time::max();                                 ///< Steps and events within, both ends included.
};

/// Reads the recording to its end. Null outputs are not written.
/// @throws InputError where a state is of another version of Knuckle, where nothing that was asked for is in the
/// recording between these times, where an output cannot be written.
void export_recording(recording::Recording& recording, const RecordingOutputs& outputs);

}  // namespace knuckle::exporting
