#include "app/replay/changed_setup.h"

#include <fmt/format.h>

#include <utility>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/load.h"

namespace knuckle::replay {
namespace {

/// Which of the two a file has replaced.
struct Replaced {
  bool machine = false, device = false;
};

/// Replaces the machine or the device that the file describes.
void put_in(const std::string& file, recording::ReplaySetup& setup, Replaced& replaced) {
  const auto once = [&file](bool& done, const char* what) {
    if (std::exchange(done, true)) cli::refuse_option("--with", file, std::string("is a second ") + what + " file");
  };
  std::string machine_error;
  try {
    setup.machine = calibrated(load_machine(file));
  } catch (const InputError& error) {
    machine_error = error.what();
  }
  if (machine_error.empty()) return once(replaced.machine, "machine");
  try {
    setup.device = load_device(file);
  } catch (const InputError& error) {
    throw InputError(fmt::format("--with {}: is neither a machine file ({}) nor a device file ({})", file,
                                 machine_error, error.what()));
  }
  once(replaced.device, "device");
}

}  // namespace

void change(recording::ReplaySetup& setup, const Changes& changes) {
  Replaced replaced;
  for (const std::string& file : changes.with) put_in(file, setup, replaced);
  if (changes.control.empty()) return;
  const auto law = control_law_named(changes.control);
  if (!law) cli::refuse_option("--control", changes.control, std::string("must be ") + kControlLawChoice);
  setup.head.law = *law;
}

}  // namespace knuckle::replay
