// `knuckle info`: what is in files of measurements.
#pragma once

#include "app/cli/command.h"

namespace knuckle::recordings {

[[nodiscard]] cli::Command info_entry();

}  // namespace knuckle::recordings
