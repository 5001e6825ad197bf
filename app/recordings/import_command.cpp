#include "app/recordings/import_command.h"

#include <iostream>
#include <memory>
#include <string>

#include "app/cli/interrupt.h"
#include "app/recordings/import.h"
#include "app/recordings/recorded_table.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle::recordings {
namespace {

struct Options {
  std::string table, map, machine, out;
};

int run(const Options& o) {
  const cli::InterruptGuard interrupt;
  cli::check_readable("the table", o.table);
  if (is_recording(o.table)) cli::refuse_option("the table", o.table, "is a recording already");
  if (!is_recording(o.out)) cli::refuse_option("--out", o.out, "must end in .mcap");
  if (!o.map.empty()) cli::check_readable("--map", o.map);
  const std::string machine_file = find_config("machine", o.machine);
  cli::Places places;
  places.input("the table", o.table);
  places.input("--map", o.map);
  places.input("--machine", machine_file);
  places.output("--out", o.out);
  const MachineDescription machine = calibrated(load_machine(machine_file));
  const RecordedFile table = read_recording(o.table, o.map, machine);
  recording::Head head;
  head.program = "knuckle import";
  head.version = cli::program_version();
  head.machine_file = whole_file(machine_file, kLargestToml_MB);
  if (!o.map.empty()) head.mapping_file = whole_file(o.map, kLargestToml_MB);
  for (const std::string& note : write_imported(table, head, machine, o.out)) std::cout << note << '\n';
  return 0;
}

}  // namespace

cli::Command import_entry() {
  return {"import", "Another program's table of sensor signals (CSV) as a recording (.mcap)",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<Options>();
            command.add_option("TABLE", options->table, "CSV file of sensor signals").required();
            command.add_option("--map", options->map,
                               "Mapping file (.toml) that says how to read it; not needed for Knuckle's own");
            command.add_option("--machine", options->machine, "Machine name or .toml file").required();
            command.add_option("--out", options->out, "The recording (.mcap)").required();
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::recordings
