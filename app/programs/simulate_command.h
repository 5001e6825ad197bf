// `knuckle simulate`: a headless session and its outputs (files, summary, verdict).
#pragma once

#include <functional>
#include <string>

#include "app/cli/command.h"
#include "app/session/options.h"
#include "app/session/session_result.h"

namespace knuckle::programs {

/// @param run gets the command line as it can be typed again, and options that are within their bounds, do not
/// contradict each other and name inputs that can be read. Outputs are checked where they are opened. @return its exit
/// code is the command's.
[[nodiscard]] cli::Command simulate_entry(
    std::function<int(const session::SimulateOptions&, const std::string& command_line)> run);

/// Opens the outputs, runs, judges, writes. @return exit code: 1 where what decides was not met, else 0.
/// @throws InputError before anything ran where an input or output is not usable.
int simulate_command(
    const session::SimulateOptions& options, const std::string& command_line,
    const std::function<session::SessionResult(const session::SimulateOptions&, const session::SessionHooks&)>& run);

}  // namespace knuckle::programs
