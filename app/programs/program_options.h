// What the programs' command lines have in common.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/background_writer.h"
#include "app/cli/json.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "app/pairing/chosen_link.h"
#include "core/histogram.h"
#include "core/realtime_thread.h"
#include "core/reason.h"
#include "machine/bus_description.h"
#include "transport/can_health.h"
#include "transport/machine_readings.h"

namespace knuckle::programs {

class ProgramConsole;

inline constexpr double kLongestRun_s = 1e7;

/// An output of a program that runs for long; it may have been requested. Writing to it never waits for its
/// reader or its disk.
class AskedOutput {
 public:
  enum class Content : std::uint8_t {
    kRecords,  ///< Line by line: those that were written are kept where others are lost.
    kResult,   ///< Whole, or of no use.
  };
  /// @param target empty: not requested. @throws InputError where it cannot be written.
  AskedOutput(const char* option, const std::string& target, Content content = Content::kRecords);

  /// nullptr: not requested.
  [[nodiscard]] std::ostream* stream() noexcept { return open_ ? &open_->writer.stream() : nullptr; }
  /// All that was put into the stream goes to where it is written. @return one line the first time after the disk, or
  /// whoever reads, refused it: it is not tried again, and the rest is lost. Else empty.
  [[nodiscard]] std::string tend();
  /// Records that were not written: refused, or not read in time.
  [[nodiscard]] std::uint64_t records_lost() const { return open_ ? open_->writer.lines_lost() : 0; }
  /// Waits until all is written, for a reader until the deadline.
  void finish(cli::BackgroundWriter::Deadline deadline);
  /// Likewise, and puts the finished file in place. Of records that were refused, those before.
  /// @throws InputError where the disk refused what was written, or a result was not read.
  void commit(cli::BackgroundWriter::Deadline deadline);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }  ///< "--csv FILE"

 private:
  struct Open {
    Open(const char* option, const std::string& target);
    cli::OutputFile file;
    cli::BackgroundWriter writer;
    std::optional<cli::PrintableOutput> on_terminal;
  };
  std::string name_;
  Content content_;
  std::optional<Open> open_;
  bool told_ = false;
};

/// Waits until all is written, for readers as long as kReaderPatience, and says what is missing then.
/// @return records lost.
[[nodiscard]] std::uint64_t finish_records(ProgramConsole& console, const std::vector<AskedOutput*>& outputs);
/// Puts every finished file in place, also where the disk refused another. @throws InputError as the first that was
/// refused.
void commit_all(const std::vector<AskedOutput*>& outputs);

/// How a loop ran, as `knuckle simulate --json` says it.
[[nodiscard]] cli::Json loop_json(const RealtimeReport& report);
/// Every counter by its name, as docs/can-bus.md lists them.
[[nodiscard]] cli::Json counters_json(const CanCounters& counters);
/// {p50, p99, max}; null where nothing was measured.
[[nodiscard]] cli::Json milliseconds_json(const Histogram& histogram);
/// {code, reason}; null where there is none.
[[nodiscard]] cli::Json reason_json(const Reason& reason, const BusDescription& bus);
/// By their names; null where one is unknown.
[[nodiscard]] cli::Json readings_json(const MachineReadings& readings);

// The link of a program that runs: what somebody types into its terminal, or writes into its standard input, to give
// control up or take it; and, where it was dialled, its paths for the result.

/// Lines, without waiting for any.
class ControlInput {
 public:
  explicit ControlInput(int descriptor) : descriptor_(descriptor) {}
  /// Lines that have come, without their ends, and of a very long one its beginning: some hundred bytes each time. None
  /// for a program in the background of its terminal, which reading would stop.
  [[nodiscard]] std::vector<std::string> lines();

 private:
  int descriptor_;
  bool ended_ = false;
  std::string text_;  // of a line that has not ended
};

/// Does what the lines say: "release", "grant", "take", or "home". @return what was done.
/// @param home asks the machine to go home on two; returns what is done.
[[nodiscard]] std::vector<cli::News> obey_control_lines(ControlInput& input, pairing::ChosenLink& link,
                                                        const std::function<std::string()>& home);

/// {pairs: [{at_s, far_end, kind, local, remote, round_trip_ms}], round_trip_ms}; null where the far end has an
/// address.
/// @param started when the program's time was 0.
[[nodiscard]] cli::Json path_json(const pairing::ChosenLink& link, std::chrono::steady_clock::time_point started);

}  // namespace knuckle::programs
