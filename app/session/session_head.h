// What stands at the beginning of a simulated session's recording.
#pragma once

#include <cstdint>
#include <string>

#include "app/session/options.h"
#include "app/session/session.h"
#include "recording/head.h"

namespace knuckle::session {

/// Begun now. @param options that the set-up was made of.
[[nodiscard]] recording::Head session_head(const SessionSetup& setup, const SimulateOptions& options);

/// The operator's side alone, of a machine that is elsewhere. @param program with its arguments.
/// @param started_unix_ns of session time 0.
[[nodiscard]] recording::Head operator_head(const std::string& program, std::int64_t started_unix_ns,
                                            const MachineDescription& machine, const DeviceDescription& device,
                                            ControlLaw law, const LinkStart& start);

}  // namespace knuckle::session
