#include "app/replay/changed_setup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle::replay {
namespace {

constexpr const char* kOfMachines = "links";  // tables that only one kind of file has
constexpr const char* kOfDevices = "joints";

/// Which of the two a file has replaced.
struct Replaced {
  bool machine = false, device = false;
};

/// Of a name among the configuration, or a file.
std::string file_of(const std::string& name_or_file) {
  const bool device = has_config("device", name_or_file);
  if (device && has_config("machine", name_or_file))
    cli::refuse_option("--with", name_or_file, "is the name of a machine and of a device: name the file");
  if (device) return find_config("device", name_or_file);
  try {
    return find_config("machine", name_or_file);
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("--with: {}; of devices there are {}", error.what(), fmt::join(config_names("device"), ", ")));
  }
}

/// Replaces the machine or the device that the file describes.
void put_in(const std::string& file, recording::ReplaySetup& setup, Replaced& replaced) {
  const auto once = [&file](bool& done, const char* what) {
    if (std::exchange(done, true)) cli::refuse_option("--with", file, std::string("is a second ") + what + " file");
  };
  const TomlTable content = TomlTable::read(file);
  if (content.has(kOfMachines)) {
    setup.machine = calibrated(load_machine(file));
    return once(replaced.machine, "machine");
  }
  if (!content.has(kOfDevices))
    throw InputError(
        fmt::format("--with {}: is neither a machine file: it has no [{}], nor a device file: it has no [{}]", file,
                    kOfMachines, kOfDevices));
  setup.device = load_device(file);
  once(replaced.device, "device");
}

}  // namespace

void change(recording::ReplaySetup& setup, const Changes& changes) {
  setup.changed = !changes.with.empty() || !changes.control.empty();
  Replaced replaced;
  for (const std::string& file : changes.with) put_in(file_of(file), setup, replaced);
  if (changes.control.empty()) return;
  if (!control_law_named(changes.control)) cli::refuse_option("--control", changes.control, kControlLawChoice);
  setup.head.law = changes.control;
}

}  // namespace knuckle::replay
