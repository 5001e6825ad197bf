// What a program that runs for long says on standard error: a line for each event, and on a terminal one line at the
// bottom that shows how things stand. In a pipe or a log there are events only. Nobody who says something waits for
// whoever reads it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/background_writer.h"
#include "app/cli/terminal.h"
#include "app/recordings/state_table.h"
#include "core/fields.h"
#include "core/realtime_thread.h"
#include "core/reason.h"
#include "core/ring.h"
#include "core/time.h"

namespace knuckle::programs {

// Events of a run that may last for weeks, and whose far end may make up as many as it likes: bounded, but the first of
// each kind is always among those that are kept.

/// Kinds of events met so far.
class EventKinds {
 public:
  static constexpr std::size_t kMost = 1024;  ///< More than any honest run has; the next count as known.
  /// @return whether this is the first of its kind.
  bool first(const std::string& kind) { return kinds_.size() < kMost && kinds_.insert(kind).second; }

 private:
  std::set<std::string> kinds_;
};

/// The first event of each kind, and of all others the newest.
template <typename Event>
class RunEvents {
 public:
  static constexpr std::size_t kMostOthers = 2000;

  /// @param kind of a bounded number: without times, values, and what a far end may choose freely.
  void add(const Event& event, const std::string& kind) {
    auto& kept = kinds_.first(kind) ? firsts_ : others_;
    kept.emplace_back(count_++, event);
    if (others_.size() <= kMostOthers) return;
    others_.pop_front();
    ++left_out_;
  }
  /// In the order they were added.
  [[nodiscard]] std::vector<Event> kept() const {
    std::vector<Numbered> all(firsts_.begin(), firsts_.end());
    all.insert(all.end(), others_.begin(), others_.end());
    std::sort(all.begin(), all.end(), [](const Numbered& a, const Numbered& b) { return a.first < b.first; });
    std::vector<Event> events;
    for (const Numbered& event : all) events.push_back(event.second);
    return events;
  }
  [[nodiscard]] std::uint64_t left_out() const noexcept { return left_out_; }

 private:
  using Numbered = std::pair<std::uint64_t, Event>;
  EventKinds kinds_;
  std::deque<Numbered> firsts_, others_;
  std::uint64_t count_ = 0, left_out_ = 0;
};

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
  void notes(const std::vector<std::string>& all) {
    for (const std::string& what : all) note(what);
  }
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

/// What blocks a machine for longer than a second is an event, also where no terminal shows it.
class StandingReason {
 public:
  /// It has been told already.
  void told(const Reason& reason) noexcept { told_ = reason; }
  /// @return whether it is to be told now.
  [[nodiscard]] bool is_news(Time now, const Reason& blocking) noexcept;

 private:
  Reason told_, standing_;
  Time since_{};
};

/// How a loop is run in a thread of its own.
struct LoopPlan {
  RealtimeOptions thread;
  std::function<void(Time)> step;      ///< The loop's thread.
  std::function<void(Time)> tend;      ///< 50 times a second, and once more after the loop's last step.
  std::function<void()> ask_to_stop;   ///< Once the run is over; empty: the loop just ends.
  std::function<bool()> stopped = {};  ///< Waited for then.
};
struct LoopRun {
  RealtimeReport report;
  Time ended_at{};
};
/// Runs the loop until the run is over and it has stopped. Tells once which scheduling class it was granted.
[[nodiscard]] LoopRun run_loop(const ProgramRun& run, const LoopPlan& loop);

/// A CSV table whose rows are made in the loop's thread.
template <typename Row>
class RowTable {
 public:
  /// @param out null: no table. @param every so many steps make a row.
  explicit RowTable(std::ostream* out, int every = 1) : every_(every) {
    if (out != nullptr) table_.emplace(*out, fields_of<Row>());
  }
  // The loop's thread.
  /// Each step: whether it makes a row.
  [[nodiscard]] bool due() noexcept { return table_ && steps_++ % every_ == 0; }
  void push(const Row& row) noexcept { rows_.push(row); }
  // The tending thread.
  void write() {
    if (!table_) return;
    Row row;
    while (rows_.pop(row)) {
      recordings::show_unknown(row);
      table_->add(&row);
    }
    table_->flush();
  }
  [[nodiscard]] std::uint64_t lost() const noexcept { return rows_.dropped(); }

 private:
  int every_, steps_ = 0;
  std::optional<recordings::StateTable> table_;
  Ring<Row, 1024> rows_;
};

/// Seconds since 1970 now: what a program's own time, which starts at 0, begins at.
[[nodiscard]] double unix_time_s();

}  // namespace knuckle::programs
