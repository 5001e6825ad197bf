// What single samples, stretches and whole channels of a recording cannot be, whatever their labels: out of range,
// dropped out, spikes, stuck, jumping.
#pragma once

#include <vector>

#include "app/identify/data_check.h"

namespace knuckle::identify {

/// Marks samples unusable in `file`; of a lone bad sample only its value is replaced, by its neighbours' mean.
/// @param commands_tell whether open valves may show that a length is stuck.
/// @param findings gets what was found.
/// @return false where a channel is out of range or zero throughout: then nothing else has been looked at.
[[nodiscard]] bool check_samples(const MachineDescription& machine, recordings::RecordedFile& file, bool commands_tell,
                                 std::vector<DataFinding>& findings);

}  // namespace knuckle::identify
