#include "app/cli/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

#include "app/cli/interrupt.h"
#include "core/error.h"
#include "core/text.h"

namespace knuckle::cli {

namespace fs = std::filesystem;
namespace {

constexpr std::chrono::milliseconds kReaderPoll{20};

/// Creates an empty file of its own, beside `target`, with the permissions any new file gets.
/// @return its descriptor; negative with errno set where that cannot be.
int create_beside(const fs::path& target, std::string& name) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    name = (target.parent_path() / ("." + target.filename().string() + "." + std::to_string(getpid()) + "." +
                                    std::to_string(attempt) + ".part"))
               .string();
    const int descriptor = open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
  return -1;
}

/// A device or a pipe. Opening a pipe without a reader would wait, and not react to signals meanwhile.
int open_in_place(const std::string& target) {
  const bool pipe = fs::is_fifo(target);
  for (;;) {
    const int descriptor = open(target.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    if (descriptor >= 0) fcntl(descriptor, F_SETFL, O_WRONLY);
    if (descriptor >= 0 || !pipe || errno != ENXIO) return descriptor;
    if (interrupt_pending()) throw Interrupted();
    std::this_thread::sleep_for(kReaderPoll);
  }
}

/// Length of the file up to the end of its last line.
off_t whole_lines(int descriptor) {
  std::array<char, 4096> part{};
  off_t end = lseek(descriptor, 0, SEEK_END);
  while (end > 0) {
    const off_t begin = std::max<off_t>(0, end - static_cast<off_t>(part.size()));
    const ssize_t size = pread(descriptor, part.data(), static_cast<std::size_t>(end - begin), begin);
    for (ssize_t i = size; i > 0; --i) {
      if (part[static_cast<std::size_t>(i - 1)] == '\n') return begin + i;
    }
    end = begin;
  }
  return 0;
}

bool same_content(const std::string& one, const std::string& other) {
  using Bytes = std::istreambuf_iterator<char>;
  std::ifstream a(one, std::ios::binary), b(other, std::ios::binary);
  return a && b && std::equal(Bytes(a), Bytes(), Bytes(b), Bytes());
}

}  // namespace

bool is_standard_output(const std::string& target) {
  return target == "-" || target == "/dev/stdout" || target == "/dev/fd/1" || target == "/proc/self/fd/1";
}

OutputFile::OutputFile(std::string option, const std::string& target)
    : option_(std::move(option)),
      target_(target),
      buffer_([this](std::string_view text) {
        return isatty(descriptor_) == 1 ? write(printable_lines(text)) : write(text);
      }),
      stream_(&buffer_) {
  if (is_standard_output(target)) {
    descriptor_ = STDOUT_FILENO;
    return;
  }
  std::error_code ignored;
  if (fs::is_directory(target, ignored)) fail(EISDIR);
  const bool exists = fs::exists(target, ignored);
  if (exists && access(target.c_str(), W_OK) != 0) fail(errno);
  if (exists && !fs::is_regular_file(target, ignored)) {
    descriptor_ = open_in_place(target_);
    if (descriptor_ < 0) fail(errno);
  } else {
    if (exists) target_ = fs::canonical(target).string();  // a link stays a link, to the new content
    open_beside();
  }
}

OutputFile::~OutputFile() {
  close_descriptor();
  if (!temporary_.empty()) unlink(temporary_.c_str());
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) rmdir(folder->c_str());
}

void OutputFile::open_beside() {
  const fs::path place = fs::absolute(target_);
  if (place.filename().empty()) fail(EISDIR);
  make_folder(place.parent_path().string());
  std::string name;
  descriptor_ = create_beside(place, name);
  if (descriptor_ >= 0) {
    temporary_ = name;
    struct stat older {};
    if (::stat(target_.c_str(), &older) == 0) (void)!fchmod(descriptor_, older.st_mode & 0777U);
    return;
  }
  const int error = errno;
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) rmdir(folder->c_str());
  fail(error);
}

void OutputFile::make_folder(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) return;
  make_folder(fs::path(folder).parent_path().string());
  if (fs::create_directory(folder, error)) made_.push_back(folder);
}

bool OutputFile::write(std::string_view text) {
  while (!text.empty() && error_ == 0) {
    const ssize_t count = ::write(descriptor_, text.data(), text.size());
    if (count >= 0) {
      text.remove_prefix(static_cast<std::size_t>(count));
    } else if (errno == EAGAIN) {  // standard output that another process set to non-blocking
      pollfd ready{descriptor_, POLLOUT, 0};
      poll(&ready, 1, -1);
    } else if (errno != EINTR) {
      error_ = errno;
    }
  }
  return error_ == 0;
}

void OutputFile::commit() {
  finish();
  if (!temporary_.empty()) put_in_place();
}

std::string OutputFile::commit_keeping_older() {
  finish();
  if (temporary_.empty() || same_content(temporary_, target_)) return {};
  std::string kept = keep_older(target_);
  put_in_place();
  return kept;
}

void OutputFile::commit_whole_lines() {
  if (temporary_.empty()) return;
  if (ftruncate(descriptor_, whole_lines(descriptor_)) != 0) fail(errno);
  close_whole();
  put_in_place();
}

void OutputFile::finish() {
  stream_.flush();
  check(error_);
  if (!temporary_.empty()) close_whole();
}

/// Some disks say only now that they are full.
void OutputFile::close_whole() {
  if (close(std::exchange(descriptor_, -1)) != 0) fail(errno);
}

void OutputFile::put_in_place() {
  if (rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno);
  temporary_.clear();
  made_.clear();
}

void OutputFile::close_descriptor() noexcept {
  if (descriptor_ > STDERR_FILENO) close(descriptor_);
  descriptor_ = -1;
}

std::string OutputFile::refusal(int error) const {
  return option_ + " " + target_ + ": cannot be written: " + std::strerror(error);
}

void OutputFile::check(int error) const {
  if (error != 0 && error != EPIPE) fail(error);
}

void OutputFile::fail(int error) const {
  throw InputError(refusal(error));
}

std::string keep_older(const std::string& target) {
  if (is_standard_output(target) || !fs::is_regular_file(target)) return {};
  const fs::path old = fs::canonical(target);
  for (int n = 1;; ++n) {
    fs::path name = old;
    name.replace_filename(old.stem().string() + "." + std::to_string(n) + old.extension().string());
    std::error_code error;
    // A second name for the same content, so that nothing is ever half copied.
    fs::create_hard_link(old, name, error);
    if (!error) return name.string();
    if (fs::exists(name)) continue;
    if (fs::copy_file(old, name, error)) return name.string();  // a file system without hard links
    throw InputError(name.string() + ": cannot be written: " + error.message());
  }
}

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
