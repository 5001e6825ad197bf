#include "app/cli/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "core/error.h"

namespace knuckle::cli {
namespace fs = std::filesystem;
namespace {

/// Creates an empty file nobody else has, beside `target`, with the permissions any new file gets.
/// @return its name; empty with errno set where that cannot be.
std::string create_beside(const fs::path& target) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    const fs::path name = target.parent_path() / ("." + target.filename().string() + "." + std::to_string(getpid()) +
                                                  "." + std::to_string(attempt) + ".part");
    const int descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) {
      close(descriptor);
      return name.string();
    }
    if (errno != EEXIST) return "";
  }
  return "";
}

}  // namespace

OutputFile::OutputFile(std::string option, const std::string& target) : option_(std::move(option)), target_(target) {
  if (target == "-") {
    stream_ = &std::cout;
    return;
  }
  stream_ = &file_;
  std::error_code ignored;
  if (fs::is_directory(target, ignored)) fail(EISDIR);
  const bool exists = fs::exists(target, ignored);
  if (exists && access(target.c_str(), W_OK) != 0) fail(errno);
  if (exists && !fs::is_regular_file(target, ignored)) {
    file_.open(target_, std::ios::binary);
  } else {
    if (exists) target_ = fs::canonical(target).string();  // a link stays a link, to the new content
    temporary_ = create_beside(fs::absolute(target_));
    if (temporary_.empty()) fail(errno);
    file_.open(temporary_, std::ios::binary | std::ios::trunc);
  }
  if (!file_) fail(errno);
}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

void OutputFile::commit() {
  const bool refused = !*stream_;
  errno = 0;
  if (refused) {  // once more, for nothing but the reason, which is forgotten
    stream_->clear();
    stream_->put('\n');
  }
  stream_->flush();
  if (refused || !*stream_) fail(errno != 0 ? errno : EIO);
  if (temporary_.empty()) return;
  file_.close();
  if (!file_ || rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno != 0 ? errno : EIO);
  temporary_.clear();
}

void OutputFile::fail(int error) const {
  throw InputError(option_ + " " + target_ + ": cannot be written: " + std::strerror(error));
}

std::string keep_older(const std::string& target) {
  if (target == "-" || !fs::is_regular_file(target)) return {};
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

}  // namespace knuckle::cli
