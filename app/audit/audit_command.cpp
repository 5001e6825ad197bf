#include "app/audit/audit_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/audit/audit_check.h"
#include "core/error.h"

namespace knuckle::audit {
namespace {

struct Options {
  std::string folder;
  bool json = false, quiet = false;
};

/// "2026-11-25T07:08:09.123Z connected: name=desk 1, fingerprint=QF3K-..."
std::string readable(const std::string& line) {
  const auto json = nlohmann::ordered_json::parse(line);
  const auto utc = json.find("utc");
  std::string text = utc != json.end() && utc->is_string() ? utc->get<std::string>() : "?";
  text += " " + json.at("event").get<std::string>();
  const char* between = ": ";
  for (const auto& [key, value] : json.items()) {
    if (key == "n" || key == "utc" || key == "mono_s" || key == "event" || key == "before") continue;
    text += between + key + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
    between = ", ";
  }
  return text;
}

int run(const Options& o) {
  const Check check = check_trail(o.folder);
  if (check.files == 0) throw InputError(o.folder + ": no audit trail is there");
  for (const std::string& line : check.lines) {
    if (!o.quiet) std::cout << (o.json ? line : readable(line)) << '\n';
  }
  std::cout << std::flush;
  if (!std::cout) throw InputError("standard output: cannot be written");
  for (const std::string& note : check.notes) std::cerr << "knuckle audit: " << note << '\n';
  if (!check.broken.empty()) {
    std::cerr << "knuckle audit: BROKEN: " << check.broken << '\n';
    return 1;
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
          [](CLI::App& command) {
            const auto options = std::make_shared<Options>();
            command.add_option("FOLDER", options->folder, "Of the trail (knuckle slave --audit)")->required();
            command.add_flag("--json", options->json, "Print the lines as they are in the files");
            command.add_flag("--quiet", options->quiet, "Print the result only");
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::audit
