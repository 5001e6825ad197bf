// `knuckle commission`: a machine's first motions, step by step at a terminal.
#pragma once

#include <string>

#include "app/bringup/commission_wizard.h"
#include "app/cli/command.h"

namespace knuckle::bringup {

// What of a commissioning that has ended is done, kept in a file so that another run can go on from there.

/// Which machine a progress is of.
struct ProgressOf {
  std::string bus, machine_sha256;  ///< Of the machine file that it was begun with.
};

/// Beside the result that the commissioning is to have.
[[nodiscard]] std::string progress_file(const std::string& out);

/// Puts it into place, whole or not at all. @throws InputError where it cannot be written.
void write_progress(const std::string& file, const WizardProgress& progress, const ProgressOf& of);

/// @throws InputError with the file and why, where it cannot be read, was edited, or is of another bus or machine file.
[[nodiscard]] WizardProgress read_progress(const std::string& file, const ProgressOf& of);

/// Exit codes: 0 it came to its end and the result is written; 1 it ended before, nothing is written; 2 wrong usage.
[[nodiscard]] cli::Command commission_entry();

}  // namespace knuckle::bringup
