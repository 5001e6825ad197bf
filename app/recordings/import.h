// A table of another program's, read through its mapping, as a recording (.mcap).
#pragma once

#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/recordings/recording_reader.h"
#include "machine/description_fwd.h"
#include "recording/head.h"

namespace knuckle::recordings {

/// Writes a state of the machine's side for each sample: what the sensors said, joint angles by the machine's geometry,
/// known valve commands. What the table does not tell is NaN, the mode off. Samples that are not usable are not
/// `measured`. The notes are events. No wires: frames that never were on a wire are not made up.
/// @param head is written too, as imported. @param machine as calibrated() gives it.
/// @return the notes: the table's, and how many values of each signal are outside the range of this machine's sensor.
/// @throws InputError where more than a fifth of a signal is outside that range, no pressure of the table reaches 2
/// bar, or `path` cannot be written; nothing is left behind then.
std::vector<std::string> write_imported(const RecordedFile& table, recording::Head head,
                                        const MachineDescription& machine, const std::string& path);

[[nodiscard]] cli::Command import_entry();

}  // namespace knuckle::recordings
