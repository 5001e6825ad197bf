// Names of configuration files into paths.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "machine/load.h"

namespace knuckle {
namespace {
namespace fs = std::filesystem;

/// The folder that the environment names; empty: none.
std::string chosen_folder() {
  const char* chosen = std::getenv("KNUCKLE_CONFIG_DIR");
  return chosen != nullptr ? chosen : "";
}

/// Where `cmake --install` puts them beside this program, whatever the prefix; else those of the checkout.
fs::path default_folder() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path installed = (program.parent_path() / KNUCKLE_INSTALLED_CONFIG_DIR).lexically_normal();
  return !program.empty() && fs::is_directory(installed, ignored) ? installed : fs::path(KNUCKLE_CHECKOUT_CONFIG_DIR);
}

fs::path folder_of(const std::string& kind) {
  const std::string chosen = chosen_folder();
  return (chosen.empty() ? default_folder() : fs::path(chosen)) / (kind + "s");
}

}  // namespace

bool has_config(const std::string& kind, const std::string& name) {
  std::error_code ignored;
  return !name.empty() && fs::is_regular_file(folder_of(kind) / (name + ".toml"), ignored);
}

std::vector<std::string> config_names(const std::string& kind) {
  std::error_code ignored;
  std::vector<std::string> names;
  for (fs::directory_iterator entry(folder_of(kind), ignored), end; entry != end; entry.increment(ignored)) {
    if (entry->path().extension() == ".toml") names.push_back(entry->path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string find_config(const std::string& kind, const std::string& name_or_path) {
  if (name_or_path.find('/') != std::string::npos || name_or_path.ends_with(".toml")) return name_or_path;
  const fs::path folder = folder_of(kind);
  if (has_config(kind, name_or_path)) return (folder / (name_or_path + ".toml")).string();
  std::error_code ignored;
  if (const std::string chosen = chosen_folder(); !chosen.empty() && !fs::is_directory(folder, ignored))
    throw InputError("KNUCKLE_CONFIG_DIR = " + chosen + ": has no folder '" + kind +
                     "s': must be a folder like config, or not set");
  if (fs::is_regular_file(name_or_path, ignored)) {
    throw InputError(kind + " '" + shortened(name_or_path) + "': is a file whose name does not end in .toml: write ./" +
                     shortened(name_or_path) + " where it is meant");
  }
  std::string all;
  for (const std::string& name : config_names(kind)) all += (all.empty() ? "" : ", ") + name;
  throw InputError("unknown " + kind + " '" + shortened(name_or_path) + "': " + folder.string() + " has " +
                   (all.empty() ? "none" : all));
}

}  // namespace knuckle
