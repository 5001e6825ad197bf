#include "machine/whole_file.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"

namespace knuckle {
namespace {

[[noreturn]] void cannot_read(const std::string& path, const std::string& why) {
  throw InputError(path + ": cannot be read: " + why);
}

}  // namespace

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
