// Names of configuration files into paths.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "machine/load.h"

namespace knuckle {

std::string find_config(const std::string& kind, const std::string& name_or_path) {
  namespace fs = std::filesystem;
  if (name_or_path.find('/') != std::string::npos || name_or_path.ends_with(".toml")) {
    return name_or_path;
  }
  const char* chosen = std::getenv("KNUCKLE_CONFIG_DIR");
  const fs::path folder =
      fs::path(chosen != nullptr && *chosen != '\0' ? chosen : KNUCKLE_DEFAULT_CONFIG_DIR) / (kind + "s");
  const fs::path file = folder / (name_or_path + ".toml");
  std::error_code ignored;
  if (!name_or_path.empty() && fs::is_regular_file(file, ignored)) {
    return file.string();
  }
  std::vector<std::string> names;
  for (fs::directory_iterator entry(folder, ignored), end; entry != end; entry.increment(ignored)) {
    if (entry->path().extension() == ".toml") {
      names.push_back(entry->path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  std::string all;
  for (const std::string& name : names) {
    all += (all.empty() ? "" : ", ") + name;
  }
  throw InputError("unknown " + kind + " '" + name_or_path + "': " + folder.string() + " has " +
                   (all.empty() ? "none" : all));
}

}  // namespace knuckle
