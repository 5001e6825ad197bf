// What all programs have beside their loops: how long they run, the records that they write meanwhile, and a result.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "app/cli/command.h"
#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/cli/options.h"
#include "app/programs/program_console.h"
#include "app/programs/program_options.h"

namespace knuckle::programs {

/// --duration, --csv and --json.
struct RunOptions {
  std::optional<double> duration_s;
  std::string csv, json;

  /// @param csv_about, @param json_about what help says of the two.
  void add(const cli::OptionList& command, const char* csv_about, const char* json_about);
  /// @throws InputError
  void check() const;
  void take(cli::Places& places) const;
};

class ProgramFrame {
 public:
  /// @param program as its lines begin: "knuckle slave". @param interrupt outlives this.
  /// @throws InputError where an output cannot be written.
  ProgramFrame(const std::string& program, const RunOptions& options, const cli::InterruptGuard& interrupt);

  ProgramConsole console;
  AskedOutput csv, json;
  ProgramRun run;  ///< Until it is interrupted, or its duration has passed.

  /// The program's own time begins now; before, when it was made.
  [[nodiscard]] const ProgramRun& start();
  [[nodiscard]] std::chrono::steady_clock::time_point started() const noexcept { return started_; }
  /// After the run: waits for the readers of records, and puts them and the result in place.
  /// @param own what the result has beside what all have. @throws InputError as commit_all()
  void finish(const char* schema, const cli::Json& own, double ran_s, std::uint64_t records_lost);

 private:
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  double started_unix_s_ = unix_time_s();
};

}  // namespace knuckle::programs
