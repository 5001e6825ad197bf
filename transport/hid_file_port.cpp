#include "transport/hid_file_port.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace knuckle {
namespace {

constexpr int kFlags = O_RDWR | O_NONBLOCK | O_CLOEXEC;
constexpr int kFailuresBeforeOpening = 100;  // at 1 kHz: ten times a second

}  // namespace

HidFilePort::HidFilePort(const std::string& option, const std::string& path)
    : path_(path), descriptor_(::open(path.c_str(), kFlags)) {
  if (!descriptor_) throw InputError(option + " " + path + ": cannot be opened: " + std::strerror(errno));
  struct stat kind {};
  if (::fstat(descriptor_.get(), &kind) != 0 || S_ISREG(kind.st_mode))
    throw InputError(option + " " + path + ": is a file, not a device: reports would be written over what is in it");
}

HidFilePort::HidFilePort(int descriptor) noexcept : descriptor_(descriptor) {
  ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
}

bool HidFilePort::write(const HidReport& report) noexcept {
  return note(::write(descriptor_.get(), report.data(), report.size()));
}

bool HidFilePort::read(HidReport& report) noexcept {
  report = {};
  return note(::read(descriptor_.get(), report.data(), report.size()));
}

/// @return whether a report was passed on.
bool HidFilePort::note(long result) noexcept {
  if (result > 0) {
    connected_ = true;
    failures_ = 0;
    return true;
  }
  if (result < 0 && (errno == EAGAIN || errno == EINTR)) return false;
  connected_ = false;
  // A gadget that is bound again has a new file under the old name; and a kernel with CVE-2026-31606 is damaged where a
  // gadget is bound again whose old file is still open.
  descriptor_.close();
  if (++failures_ % kFailuresBeforeOpening == 0 && !path_.empty())
    descriptor_ = Descriptor(::open(path_.c_str(), kFlags));
  return false;
}

}  // namespace knuckle
