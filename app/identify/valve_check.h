// Whether recorded valve commands are what their columns say: fractions, signed as the cylinder moves, of their own
// axis.
#pragma once

#include "app/identify/data_check.h"

namespace knuckle::identify {

/// Single commands beyond [-1, 1] become unknown (NaN), and so does a column that its cylinder does not follow. Refused
/// are columns that are mostly beyond, and, where the cylinders moved enough to judge, a column that runs against its
/// cylinder or commands that move another cylinder than the one they are named for. Lengths are taken as they are.
[[nodiscard]] std::vector<DataFinding> check_valves(recordings::RecordedFile& file);

}  // namespace knuckle::identify
