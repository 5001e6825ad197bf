// `knuckle simulate`: a headless session and its outputs (files, summary, verdict).
#pragma once

#include <functional>

#include "app/command.h"
#include "app/options.h"
#include "app/session_result.h"

namespace knuckle::app {

/// @param run gets options that are within their bounds, do not contradict each other and name inputs that can be read.
/// Outputs are checked where they are opened. @return its exit code is the command's.
[[nodiscard]] Command simulate_entry(std::function<int(const SimulateOptions&)> run);

/// Opens the outputs, runs, judges, writes. @return exit code: 0 criteria met, 1 not met.
/// @throws InputError before anything ran where an input or output is not usable.
int simulate_command(const SimulateOptions& options,
                     const std::function<SessionResult(const SimulateOptions&, const SessionHooks&)>& run);

}  // namespace knuckle::app
