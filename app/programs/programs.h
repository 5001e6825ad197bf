// The commands that run the loops: `knuckle simulate`, `master`, `slave`, `node` and `device`.
#pragma once

#include <functional>
#include <string>

#include "app/cli/command.h"
#include "app/programs/slave_cameras.h"
#include "app/session/options.h"
#include "app/session/session_result.h"

namespace knuckle::programs {

/// The operator's side with a haptic device, without a screen. Exit codes: 0 it was interrupted, or its duration has
/// passed; 1 machine or device was not there at any time.
[[nodiscard]] cli::Command master_entry();

/// The machine's side on a CAN interface. Exit codes: 0 it was interrupted, or its duration has passed.
/// @param draw makes cameras of the simulated machine.
[[nodiscard]] cli::Command slave_entry(DrawCamera draw);

/// A simulated machine's nodes on a CAN interface. Exit codes: 0 it was interrupted, or its duration has passed.
[[nodiscard]] cli::Command node_entry();

/// The simulated firmware and hand on a USB gadget. Exit codes: 0 interrupted, or the operator has finished; 1 the
/// operator timed out, or was interrupted before; 2 wrong usage.
[[nodiscard]] cli::Command device_entry();

// A headless session and its outputs: files, summary, verdict.

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
