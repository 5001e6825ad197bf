#include "app/cli/file_owner.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace knuckle::cli {

void check_only_owner_writes(const std::string& path, const char* what, const char* danger) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw InputError(path + ": " + std::strerror(errno));
  if (status.st_uid != ::geteuid() && status.st_uid != 0)
    throw InputError(fmt::format("{}: the {} belongs to another user, who could {}", path, what, danger));
  if ((status.st_mode & 022U) == 0) return;
  throw InputError(fmt::format("{}: mode {:04o} of the {} lets others write it, and so {}: chmod go-w", path,
                               status.st_mode & 07777U, what, danger));
}

}  // namespace knuckle::cli
