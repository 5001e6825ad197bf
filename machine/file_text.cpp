#include "machine/file_text.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/error.h"

namespace knuckle {
namespace {

/// The key that a line sets, or its [table] in brackets, without the spaces that it may have; empty where it does
/// neither.
std::string key_of(const std::string& line) {
  const auto begin = line.find_first_not_of(" \t");
  if (begin == std::string::npos || line[begin] == '#') return "";
  if (line[begin] == '[') {
    std::string table = line.substr(begin, line.rfind(']', line.find('#')) - begin + 1);
    std::erase_if(table, [](char c) { return c == ' ' || c == '\t'; });
    return table;
  }
  const auto equals = line.find('=', begin);
  if (equals == std::string::npos) return "";
  const auto end = line.find_last_not_of(" \t", equals - 1);
  return line.substr(begin, end - begin + 1);
}

/// Whether `key` opens the table `name` or one inside it.
bool opens(std::string_view key, std::string_view name) {
  key.remove_prefix(std::min(key.find_first_not_of(" \t["), key.size()));
  return key.starts_with(name) && key.find_first_of(" \t.]", name.size()) == name.size();
}

[[noreturn]] void cannot_read(const std::string& path, const std::string& why) {
  throw InputError(path + ": cannot be read: " + why);
}

}  // namespace

std::string edited_toml(
    std::string_view text,
    const std::function<void(const std::string& table, const std::string& key, std::string& line)>& edit) {
  std::istringstream lines{std::string(text)};
  std::string edited, table;
  for (std::string line; std::getline(lines, line);) {
    const std::string key = key_of(line);
    const bool was_empty = line.empty();
    if (key.starts_with('[')) table = key;
    edit(table, key, line);
    if (was_empty || !line.empty()) edited += line + '\n';
  }
  if (!text.ends_with('\n') && !edited.empty()) edited.pop_back();
  return edited;
}

std::string without_toml_record(std::string_view text, std::string_view name, std::string_view opening) {
  std::istringstream lines{std::string(text)};
  std::string kept;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (const std::string key = key_of(line); key.starts_with('[')) inside = opens(key, name);
    const bool opens_record = std::string_view(line).substr(0, line.find_last_not_of("\r \t") + 1) == opening;
    if (!inside && !opens_record) kept += line + '\n';
  }
  kept.erase(kept.find_last_not_of("\n\r \t") + 1);
  return kept + '\n';
}

std::string with_toml_value(const std::string& line, const std::string& value) {
  const auto equals = line.find('=');
  const auto comment = line.find('#', equals);
  std::string changed = line.substr(0, equals + 1) + " " + value;
  if (comment == std::string::npos) return line.ends_with('\r') ? changed + '\r' : changed;
  changed.resize(std::max(changed.size() + 1, comment), ' ');
  return changed + line.substr(comment);
}

std::string toml_quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  }
  return quoted + '"';
}

std::string whole_file(const std::string& path, std::size_t most_MB) {
  std::error_code error;  // such as links in a circle: the file then says why when it is opened
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error))
    cannot_read(path, "is not a regular file");
  const std::size_t most = most_MB * 1'000'000;
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) cannot_read(path, std::strerror(errno));
  std::string text;
  std::array<char, 1 << 16> block;
  while (file.read(block.data(), block.size()) || file.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > most) throw InputError(path + ": must be at most " + std::to_string(most_MB) + " MB");
  }
  if (file.bad()) cannot_read(path, std::strerror(errno));
  return text;
}

}  // namespace knuckle
