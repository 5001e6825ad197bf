#include "machine/toml_lines.h"

#include <algorithm>

namespace knuckle {

std::string toml_key(const std::string& line) {
  const auto begin = line.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  if (line[begin] == '[') return line.substr(begin, line.rfind(']', line.find('#')) - begin + 1);
  const auto equals = line.find('=', begin);
  if (equals == std::string::npos) return "";
  const auto end = line.find_last_not_of(" \t", equals - 1);
  return line.substr(begin, end - begin + 1);
}

std::string with_toml_value(const std::string& line, const std::string& value) {
  const auto equals = line.find('=');
  const auto comment = line.find('#', equals);
  std::string changed = line.substr(0, equals + 1) + " " + value;
  if (comment == std::string::npos) return changed;
  changed.resize(std::max(changed.size() + 1, comment), ' ');
  return changed + line.substr(comment);
}

}  // namespace knuckle
