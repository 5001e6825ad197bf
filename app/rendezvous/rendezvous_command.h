// `knuckle rendezvous`: where two ends behind NAT find each other.
#pragma once

#include "app/cli/command.h"

namespace knuckle::rendezvous {

[[nodiscard]] cli::Command rendezvous_entry();

}  // namespace knuckle::rendezvous
