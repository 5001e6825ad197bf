// `knuckle console`: the operator's window.
#pragma once

#include "app/command.h"

namespace knuckle::app {

[[nodiscard]] Command console_entry();

}  // namespace knuckle::app
