#include "app/audit/audit_command.h"

#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "app/audit/audit_check.h"
#include "app/cli/output_file.h"
#include "core/error.h"

namespace knuckle::audit {
namespace {

struct Options {
  std::string folder;
  bool json = false, quiet = false;
};

int run(const Options& o) {
  if (o.json && o.quiet) cli::refuse_option("--json", "", "does not go with --quiet, which prints no lines");
  const Check check = check_trail(o.folder);
  if (check.files == 0 && !read_head(o.folder)) throw InputError(o.folder + ": no audit trail is there");
  if (o.json) {
    cli::OutputFile out("standard output", "-");
    for (const std::string& line : check.lines) out.stream() << line << '\n';
    out.commit();
  } else if (!o.quiet) {
    for (const std::string& line : check.lines) std::cout << readable(line) << '\n';
  }
  std::cout << std::flush;
  if (!std::cout) throw InputError("standard output: cannot be written");
  for (const std::string& note : check.notes) std::cerr << "knuckle audit: " << note << '\n';
  for (const std::string& broken : check.breaks) std::cerr << "knuckle audit: BROKEN: " << broken << '\n';
  if (!check.breaks.empty()) return 1;
  if (check.lines.empty()) {
    std::cerr << "knuckle audit: whole, and empty: no line has been written\n";
    return 0;
  }
  std::cerr << fmt::format(
      "knuckle audit: whole: {} lines in {} files; the last is {} with hash {}: keep a note of it "
      "elsewhere\n",
      check.lines.size(), check.files, check.last.number, check.last.hash);
  return 0;
}

}  // namespace

cli::Command audit_entry() {
  return {"audit", "Print an audit trail of the machine's side, and check that nobody has changed it",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<Options>();
            command.add_option("FOLDER", options->folder, "Of the trail (knuckle slave --audit)").required();
            command.add_flag("--json", options->json, "Print the lines as they are in the files");
            command.add_flag("--quiet", options->quiet, "Print the result only");
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::audit
