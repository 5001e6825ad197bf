#include "app/replay/changed_setup.h"

#include <fmt/format.h>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/load.h"

namespace knuckle::replay {
namespace {

/// Replaces the machine or the device that the file describes.
void put_in(const std::string& file, recording::ReplaySetup& setup) {
  std::string machine_error;
  try {
    setup.machine = calibrated(load_machine(file));
    return;
  } catch (const InputError& error) {
    machine_error = error.what();
  }
  try {
    setup.device = load_device(file);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--with {}: is neither a machine file ({}) nor a device file ({})", file,
                                 machine_error, error.what()));
  }
}

}  // namespace

void change(recording::ReplaySetup& setup, const Changes& changes) {
  for (const std::string& file : changes.with) put_in(file, setup);
  if (changes.control.empty()) return;
  const auto law = control_law_named(changes.control);
  if (!law) cli::refuse_option("--control", changes.control, std::string("must be ") + kControlLawChoice);
  setup.head.law = *law;
}

}  // namespace knuckle::replay
