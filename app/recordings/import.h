// A table of another program's, read through its mapping, as a recording (.mcap).
#pragma once

#include <string>

#include "app/recordings/recording_reader.h"
#include "machine/description_fwd.h"
#include "recording/head.h"

namespace knuckle::recordings {

/// Writes a state of the machine's side for each sample: what the sensors said, joint angles by the machine's geometry,
/// known valve commands (others NaN); mode off, no confidence. Samples that are not usable are not `measured`. The
/// notes are events. No wires: frames that never were on a wire are not made up.
/// @param head is written too, as imported. @param machine as calibrated() gives it.
/// @throws InputError where `path` cannot be written; nothing is left behind then.
void write_imported(const RecordedFile& table, recording::Head head, const MachineDescription& machine,
                    const std::string& path);

}  // namespace knuckle::recordings
