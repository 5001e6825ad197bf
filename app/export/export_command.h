// `knuckle export`: files for other tools.
#pragma once

#include "app/cli/command.h"

namespace knuckle::exporting {

[[nodiscard]] cli::Command export_entry();

}  // namespace knuckle::exporting
