// An output that is either complete or not there: written beside its target and renamed into place at the end.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/text_buffer.h"

namespace knuckle::cli {

/// "-", or a name that the system has for the same: /dev/stdout, /dev/fd/1, /proc/self/fd/1.
[[nodiscard]] bool is_standard_output(const std::string& target);

class OutputFile {
 public:
  /// Opens a temporary file in the target's folder, which is made where it is missing; the target itself is untouched
  /// until commit(), and keeps its mode. What is_standard_output() is written to directly; a target that is no regular
  /// file (a pipe, /dev/null) is written to directly. A named pipe waits for its reader.
  /// @param option named in messages, such as "--csv".
  /// @throws InputError where the target cannot be written, Interrupted where a signal came before a pipe's reader.
  OutputFile(std::string option, const std::string& target);
  /// Without commit(): nothing is left behind.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// May wait for whoever reads it. A terminal gets what is printable (printable_lines), whatever was put in.
  [[nodiscard]] std::ostream& stream() noexcept { return stream_; }
  /// Puts the finished file in place. @throws InputError where the disk refused what was written.
  void commit();
  /// As commit(); what the target held is then kept (keep_older). Where it holds the same already, it stays as it is.
  /// @return the name of what was kept; empty where there was none or nothing changed.
  std::string commit_keeping_older();

  // For what is written to the descriptor instead of the stream.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// After the disk refused the rest: what there is, up to its last whole line, in place.
  void commit_whole_lines();
  /// "--csv FILE: cannot be written: No space left on device". @param error an errno.
  [[nodiscard]] std::string refusal(int error) const;
  /// @throws InputError refusal().
  [[noreturn]] void fail(int error) const;
  /// As fail(), unless there is no error, or the one who read a pipe reads no more: he has lost nothing.
  void check(int error) const;

 private:
  void open_beside();
  void make_folder(const std::string& folder);
  bool write(std::string_view text);
  void finish();
  void close_whole();
  void put_in_place();
  void close_descriptor() noexcept;

  std::string option_, target_, temporary_;  // temporary_ is empty when writing directly
  std::vector<std::string> made_;            // folders, while nothing is in them
  int descriptor_ = -1, error_ = 0;          // error_: errno of the first write that was refused
  TextBuffer buffer_;
  std::ostream stream_;
};

/// An output that may not have been asked for.
class OptionalOutput {
 public:
  /// @param target empty: not asked for. @throws InputError as OutputFile.
  OptionalOutput(const std::string& option, const std::string& target) {
    if (!target.empty()) file_.emplace(option, target);
  }
  [[nodiscard]] explicit operator bool() const noexcept { return file_.has_value(); }
  [[nodiscard]] OutputFile& operator*() noexcept { return *file_; }
  [[nodiscard]] OutputFile* operator->() noexcept { return &*file_; }
  /// As OutputFile's, where it was asked for.
  void commit() {
    if (file_) file_->commit();
  }
  /// Likewise, of what `write_to` puts into the stream.
  template <typename WriteTo>
  void write(const WriteTo& write_to) {
    if (file_) write_to(file_->stream());
    commit();
  }

 private:
  std::optional<OutputFile> file_;
};

/// Before a file is overwritten: FILE.toml is kept as FILE.N.toml, the next free number.
/// @return that name; empty where there is no such regular file. @throws InputError where it cannot be kept.
std::string keep_older(const std::string& target);

// Files and folders that nobody but their owner may change.

/// @param what "file" or "folder". @param danger what anybody else could do, for the message: "change the audit trail".
/// @throws InputError where it belongs to another user (but root), or anybody else may write it.
void check_only_owner_writes(const std::string& path, const char* what, const char* danger);

}  // namespace knuckle::cli
