// What a program that runs for long says on standard error: a line for each event, and on a terminal one line at the
// bottom that shows how things stand. In a pipe or a log there are events only.
#pragma once

#include <functional>
#include <limits>
#include <ostream>
#include <string>

#include "core/realtime_thread.h"
#include "core/time.h"

namespace knuckle::programs {

class ProgramConsole {
 public:
  /// @param program such as "knuckle slave", before every event. @param terminal `out` can take a line back.
  ProgramConsole(std::string program, std::ostream& out, bool terminal);
  /// On standard error.
  explicit ProgramConsole(std::string program);
  /// Takes the status line back.
  ~ProgramConsole();
  ProgramConsole(const ProgramConsole&) = delete;
  ProgramConsole& operator=(const ProgramConsole&) = delete;

  /// Before or after the run.
  void note(const std::string& what);
  void event(Time at, const std::string& what);
  /// Shown on a terminal, anew once a second.
  void status(Time now, const std::string& line);

 private:
  void take_back();

  std::string program_;
  std::ostream& out_;
  bool terminal_, shown_ = false;
  Time shown_at_ = kNever;
};

/// How long a program runs, and what it tells while it does; both in the thread that called it.
struct ProgramRun {
  std::function<bool()> keep_on;  ///< Asked 50 times a second; false ends the program in order.
  ProgramConsole& console;
  double duration_s = std::numeric_limits<double>::infinity();
};

/// Calls `tend` 50 times a second until the run is over: asked to end, or its time has come.
void tend_until_over(const ProgramRun& run, const RealtimeClock& clock, const std::function<void(Time)>& tend);

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
