#include "app/pairing/private_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "app/cli/file_owner.h"
#include "core/descriptor.h"
#include "core/error.h"

namespace knuckle::pairing {
namespace {

[[noreturn]] void refuse(const std::string& file, int error) {
  throw InputError(file + ": cannot be written: " + std::strerror(error));
}

/// @return 0, or errno.
int write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return ::fsync(descriptor) == 0 ? 0 : errno;
}

/// Or a power cut may bring the old name back.
void sync_folder_of(const std::string& file) {
  const std::string folder = std::filesystem::absolute(file).parent_path();
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor) (void)::fsync(descriptor.get());
}

}  // namespace

void write_private_file(const std::string& file, const std::string& text, Existing existing) {
  std::string beside = file + kLeftOver + "XXXXXX";
  Descriptor descriptor(::mkostemp(beside.data(), O_CLOEXEC));  // mode 0600
  if (!descriptor) refuse(file, errno);
  int error = write_all(descriptor.get(), text);
  if (const int refused = descriptor.close(); error == 0) error = refused;
  // A second name fails where there is a file; renaming would replace it.
  if (error == 0) {
    const bool put = existing == Existing::kReplace ? ::rename(beside.c_str(), file.c_str()) == 0
                                                    : ::link(beside.c_str(), file.c_str()) == 0;
    if (!put) error = errno;
  }
  if (error != 0 || existing == Existing::kRefuse) ::unlink(beside.c_str());
  if (error == EEXIST) throw InputError(file + ": is there already");
  if (error != 0) refuse(file, error);
  sync_folder_of(file);
}

void check_only_owner_writes(const std::string& path, const char* what) {
  cli::check_only_owner_writes(path, what, "let anybody control the machine");
}

}  // namespace knuckle::pairing
