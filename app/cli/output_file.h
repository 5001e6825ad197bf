// An output that is either complete or not there: written beside its target and renamed into place at the end.
#pragma once

#include <fstream>
#include <ostream>
#include <string>

namespace knuckle::cli {

class OutputFile {
 public:
  /// Opens a temporary file in the target's folder; the target itself is untouched until commit(). "-" is standard
  /// output; a target that is no regular file (a pipe, /dev/null) is written to directly.
  /// @param option named in messages, such as "--csv".
  /// @throws InputError where the target cannot be written.
  OutputFile(std::string option, const std::string& target);
  /// Without commit(): nothing is left behind.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  [[nodiscard]] std::ostream& stream() noexcept { return *stream_; }
  /// Puts the finished file in place. @throws InputError where the disk refused what was written.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;

  std::string option_, target_, temporary_;  // temporary_ is empty when writing directly
  std::ofstream file_;
  std::ostream* stream_ = nullptr;
};

/// Before a file is written anew: FILE.toml is kept as FILE.N.toml, the next free number.
/// @return that name; empty where there is no such regular file. @throws InputError where it cannot be kept.
std::string keep_older(const std::string& target);

}  // namespace knuckle::cli
