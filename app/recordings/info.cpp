#include "app/recordings/info.h"

#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/interrupt.h"
#include "app/recordings/recorded_table.h"

namespace knuckle::recordings {
namespace {

struct InfoOptions {
  std::vector<std::string> files;
  std::string map;
};

int run_info(const InfoOptions& o) {
  const cli::InterruptGuard interrupt;
  if (!o.map.empty()) cli::check_readable("--map", o.map);
  bool whole = true;
  for (const std::string& file : o.files) {
    if (is_recording(file) && !o.map.empty())
      cli::refuse_option("--map", o.map, "is of tables; " + file + " is a recording");
    const FileInfo info = is_recording(file) ? recording_info(file) : table_info(file, o.map);
    for (const std::string& line : info.lines) std::cout << line << '\n';
    whole = whole && info.whole;
  }
  return whole ? 0 : 1;
}

}  // namespace

cli::Command info_entry() {
  return {"info", "What is in recordings (.mcap) and tables (CSV), from when to when, and whether it is damaged",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<InfoOptions>();
            command.add_option("FILE", options->files, "Recordings (.mcap) or tables (CSV)").required();
            command.add_option("--map", options->map, "Mapping file (.toml) of tables of other programs");
            return [options] { return run_info(*options); };
          }};
}

}  // namespace knuckle::recordings
