#include "app/export/export_command.h"

#include <CLI/CLI.hpp>
#include <array>
#include <list>
#include <memory>
#include <string>

#include "app/cli/output_file.h"
#include "app/export/dbc.h"
#include "app/export/urdf.h"
#include "core/error.h"
#include "machine/description.h"
#include "machine/load.h"

namespace knuckle::exporting {
namespace {

/// A file that is made of the machine file alone.
struct MachineOutput {
  const char *option, *about;
  void (*write)(const MachineDescription& machine, std::ostream& out);
};
constexpr std::array kMachineOutputs{
    MachineOutput{"--urdf", "The arm as URDF: links, joints, inertias, shapes without meshes", write_urdf},
    MachineOutput{"--dbc", "The machine's CAN bus as DBC: every frame and what is in it", write_dbc},
};

struct Options {
  std::string machine;
  std::array<std::string, kMachineOutputs.size()> targets;  ///< Empty: not asked for.
};

void check(const Options& o, const std::string& machine_file) {
  cli::Places places;
  places.input("--machine", machine_file);
  bool any = false;
  for (std::size_t i = 0; i < kMachineOutputs.size(); ++i) {
    places.output(kMachineOutputs[i].option, o.targets[i]);
    any = any || !o.targets[i].empty();
  }
  if (!any) throw InputError("nothing to write: give --urdf FILE or --dbc FILE (see knuckle export --help)");
}

int run(const Options& o) {
  const std::string machine_file = find_config("machine", o.machine);
  check(o, machine_file);
  const MachineDescription machine = load_machine(machine_file);
  std::list<cli::OutputFile> files;  // all written before the first is put in place
  for (std::size_t i = 0; i < kMachineOutputs.size(); ++i) {
    if (o.targets[i].empty()) continue;
    kMachineOutputs[i].write(machine, files.emplace_back(kMachineOutputs[i].option, o.targets[i]).stream());
  }
  for (cli::OutputFile& file : files) file.commit();
  return 0;
}

}  // namespace

cli::Command export_entry() {
  return {"export", "Files for other tools: the machine's model as URDF, its CAN bus as DBC", [](CLI::App& command) {
            const auto options = std::make_shared<Options>();
            command.add_option("--machine", options->machine, "Machine name or .toml file")->required();
            for (std::size_t i = 0; i < kMachineOutputs.size(); ++i) {
              command.add_option(kMachineOutputs[i].option, options->targets[i],
                                 std::string(kMachineOutputs[i].about) + " (- = standard output)");
            }
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::exporting
