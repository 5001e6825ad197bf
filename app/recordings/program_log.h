// The recording of a program that drives something real: on unless turned off; flight records always.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/cli/json.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "machine/description_fwd.h"
#include "recording/head.h"
#include "recording/recorder.h"

namespace knuckle::recordings {

struct LogOptions {
  std::string folder;  ///< Empty: recording::default_folder().
  bool off = false;
};
/// @param without_log help of --no-log: what is kept nevertheless.
void add_log_options(
    const cli::OptionList& command, LogOptions& options,
    const std::string& without_log = "Record nothing but the last half minute of every fault and stop");
/// @throws InputError where both are given.
void check_log(const LogOptions& options);

class ProgramLog {
 public:
  /// @param real something real is driven: else there is a recording only where a folder was named.
  /// @throws InputError where the folder that was named cannot be written. The default one may be missing: then there
  /// is no recording, and notes() says so.
  ProgramLog(const LogOptions& options, bool real, recording::Head head, const MachineDescription& machine);
  ~ProgramLog();
  ProgramLog(const ProgramLog&) = delete;
  ProgramLog& operator=(const ProgramLog&) = delete;

  /// From now on a thread of its own writes what the loops hand over; before, recorder()->drain() does.
  void begin();
  /// nullptr: nothing is recorded, and no flight record written.
  [[nodiscard]] recording::Recorder* recorder() noexcept { return recorder_.get(); }
  /// The session goes into parts, or would had nothing refused them; else flight records alone, if anything.
  [[nodiscard]] bool kept() const noexcept { return kept_ || !failure_.empty(); }
  /// Why a recording that is wanted is none; empty: it is one.
  [[nodiscard]] std::string problem() const;
  /// For the program's start: where it is recorded to, or that it is not.
  [[nodiscard]] std::vector<std::string> notes() const;
  /// What has come up since the last call: flight records, a recording that has ended.
  [[nodiscard]] std::vector<cli::News> news();
  /// After the loops have ended: finishes the files.
  void close();
  [[nodiscard]] cli::Json json() const;

 private:
  bool kept_ = false;
  std::string folder_, failure_;
  std::unique_ptr<recording::Recorder> recorder_;
  std::unique_ptr<recording::RecorderThread> thread_;
  std::size_t flights_told_ = 0, notices_told_ = 0;
  std::string problem_told_;
};

}  // namespace knuckle::recordings
