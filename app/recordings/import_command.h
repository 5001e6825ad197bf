// `knuckle import`: a table of another program's as a recording.
#pragma once

#include "app/cli/command.h"

namespace knuckle::recordings {

[[nodiscard]] cli::Command import_entry();

}  // namespace knuckle::recordings
