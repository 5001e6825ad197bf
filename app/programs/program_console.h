// What a program that runs for long says on standard error: a line for each event, and on a terminal one line at the
// bottom that shows how things stand. In a pipe or a log there are events only. Nobody who says something waits for
// whoever reads it.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/background_writer.h"
#include "app/cli/terminal.h"
#include "app/programs/run_events.h"
#include "core/realtime_thread.h"
#include "core/time.h"

namespace knuckle::programs {

class AskedOutput;

/// For one thread.
class ProgramConsole {
 public:
  /// Events shown in any 10 s; beyond them, only the first of each kind. The number of the others is shown.
  static constexpr int kMostEvents = 20;
  static constexpr Duration kEventSpan = 10s;

  /// @param program such as "knuckle slave", before every event. @param out must not wait. @param terminal it can take
  /// a line back.
  ProgramConsole(std::string program, std::ostream& out, bool terminal);
  /// On standard error. What is not read there in time is lost, and counted.
  explicit ProgramConsole(std::string program);
  /// Takes the status line back.
  ~ProgramConsole();
  ProgramConsole(const ProgramConsole&) = delete;
  ProgramConsole& operator=(const ProgramConsole&) = delete;

  /// Before or after the run.
  void note(const std::string& what);
  /// Told in the order of their times, at the next tend() or note() but one. @param kind what makes it another event
  /// than those before: its text without what differs each time; empty: the whole text.
  void event(Time at, const std::string& what, const std::string& kind = "");
  /// Shown on a terminal, updated once a second, in one line. @param parts "engaged", "round trip 12 ms"; where they
  /// are too long for it, the longest is cut.
  void status(Time now, const std::vector<std::string>& parts);
  /// Often, after what there is to say.
  void tend(Time now);
  /// Not read in time.
  [[nodiscard]] std::uint64_t lines_lost() const { return own_ ? own_->lines_lost() : 0; }

 private:
  struct Event {
    Time at{};
    std::string what, kind;
  };
  void say(const std::string& line);
  void tell_until(Time until);
  void tell(const Event& event);
  void tell_left_out(Time now);
  void take_back();

  std::string program_;
  std::optional<cli::BackgroundWriter> own_;
  std::ostream& out_;
  bool terminal_, shown_ = false;
  Time shown_at_ = kNever;
  std::vector<Event> waiting_;
  EventKinds kinds_;
  Time span_began_ = kNever, told_at_{};
  int told_in_span_ = 0;
  std::uint64_t left_out_ = 0, lost_told_ = 0;
};

/// One line of at most this many characters. @param parts joined by " | ", each ends in "..." where it had to be cut.
[[nodiscard]] std::string fitted(std::vector<std::string> parts, std::size_t width);

/// How long a program runs, and what it reports while it does; all in the thread that called it, which never waits but
/// for the next time to look.
struct ProgramRun {
  std::function<bool()> keep_on;  ///< Asked 50 times a second; false ends the program in order.
  ProgramConsole& console;
  double duration_s = std::numeric_limits<double>::infinity();
  std::vector<AskedOutput*> outputs{};  ///< Records that are written while it runs.
  /// What has happened beyond the loops; may be empty itself.
  std::function<std::vector<cli::News>()> news{};
};

/// Calls `tend` 50 times a second until the run is over: interrupted, or its duration has passed.
void tend_until_over(const ProgramRun& run, const RealtimeClock& clock, const std::function<void(Time)>& tend);
/// The same of what was asked to stop, until it has, whatever ends the run.
void tend_until_stopped(const ProgramRun& run, const RealtimeClock& clock, const std::function<void(Time)>& tend,
                        const std::function<bool()>& stopped);

/// Tells once which scheduling class the loop was granted.
class PolicyNote {
 public:
  explicit PolicyNote(const char* loop) : loop_(loop) {}
  void tell(ProgramConsole& console, Time now, const RealtimeThread& thread);

 private:
  const char* loop_;
  bool told_ = false;
};

/// Seconds since 1970 now: what a program's own time, which starts at 0, begins at.
[[nodiscard]] double unix_time_s();

}  // namespace knuckle::programs
