// One number for a whole session: SHA-256 over every sample and every CAN frame. Equal digests mean equal sessions.
#pragma once

#include "app/cli/digest.h"
#include "app/session/session_record.h"
#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle::session {

void add(cli::Digest& digest, const Sample& sample);
void add(cli::Digest& digest, Time at, const CanFrame& frame);

}  // namespace knuckle::session
