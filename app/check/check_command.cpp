#include "app/check/check_command.h"

#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "app/check/file_check.h"
#include "app/check/machine_sheet.h"
#include "app/cli/output_file.h"
#include "core/error.h"

namespace knuckle::checking {
namespace {

struct Options {
  std::string file, machine, drawing;
};

int run(const Options& o) {
  cli::Places places;
  places.input("the file", o.file);
  places.configuration("--machine", o.machine);
  places.output("--drawing", o.drawing);
  const FileCheck found = check_file(o.file, o.machine);
  if (!found.errors.empty()) {
    for (const std::string& error : found.errors) std::cerr << "knuckle: " << error << '\n';
    return 2;
  }
  std::optional<cli::OutputFile> drawing;
  if (!o.drawing.empty()) {
    if (!found.machine)
      cli::refuse_option("--drawing", o.drawing, "only goes with a machine file; this is of kind " + found.kind);
    drawing.emplace("--drawing", o.drawing);
    draw_machine_sheet(*found.machine, drawing->stream());
  }
  std::ostream& out = cli::is_standard_output(o.drawing) ? std::cerr : std::cout;
  out << o.file << ": " << found.kind << " file, no errors\n";
  for (const std::string& line : found.lines) out << "  " << line << '\n';
  for (const std::string& note : found.notes) out << "  note: " << note << '\n';
  if (drawing) {
    drawing->commit();
    out << "  drawing: " << o.drawing << '\n';
  }
  return 0;
}

}  // namespace

cli::Command check_entry() {
  return {"check", "All that is wrong with a configuration file at once; of a right one, what follows from its numbers",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<Options>();
            command
                .add_option("FILE", options->file,
                            "Machine, device, scenario, link, mapping, truth or grid file (.toml)")
                .required();
            command.add_option("--machine", options->machine,
                               "Machine that a scenario, truth or device file is for: name or .toml file (default: "
                               "solar015; a device by itself)");
            command.add_option("--drawing", options->drawing,
                               "Draw a machine file's arm, pins, joint ranges and limits (.svg)");
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::checking
