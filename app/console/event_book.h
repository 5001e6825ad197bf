// What happened in a session: events as the loops' thread notes them in the very step, plain data on their way to the
// window, and the book that the window keeps of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>
#include <vector>

#include "app/console/hand_input.h"
#include "core/reason.h"
#include "core/ring.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "master/master_loop.h"
#include "sim/world.h"
#include "transport/link_messages.h"

namespace knuckle::console {

// What happened, as the loops' thread notes it in the very step: plain data on its way to the event book, so that a
// window that stalls misses nothing.

enum class ConsoleEventKind : std::uint8_t {
  kMachine,   ///< mode or fault changed: mode, reason = the fault, or what blocks
  kBlocked,   ///< reason has blocked, or limited, for more than a second
  kDevice,    ///< reason why the device cannot be used; kNone: it can
  kLink,      ///< on: packets from the machine are received
  kContact,   ///< on; value: force on the tip [N]
  kTooMuch,   ///< on: value is beyond limit, the maximum that the person has set [N]; off: it is well within again
  kPiece,     ///< simulated world: piece; value as its event says
  kStop,      ///< on: pressed in
  kInput,     ///< on: what is held counts again; off: the window has stalled, inputs count as released
  kAttended,  ///< on: the window has the focus; off: it has not, inputs count as released
  kScales,    ///< on: taken; off: refused while the machine is led
  kWarning,   ///< reason; kNone: over
  kPaused,    ///< on
  kNewStart,  ///< the simulated session was restarted
  kTooSmall,  ///< on: the window has no room for any screen, inputs count as released; off: it has again
  kOwnPause,  ///< the loop did not run for value [s], and the machine's fault comes of that
};

struct ConsoleEvent {
  ConsoleEventKind kind = ConsoleEventKind::kMachine;
  Time at{};              ///< Of the session on screen.
  std::uint32_t run = 1;  ///< Which session: counts restarts.
  bool on = false;
  Mode mode = Mode::kOff;
  Reason reason{};
  sim::WorldEventKind piece = sim::WorldEventKind::kPieceBroke;
  double value = 0, limit = 0;
};

enum class Severity : std::uint8_t { kInfo, kWarning, kAlarm };
[[nodiscard]] const char* name(Severity severity) noexcept;  ///< "info", "warning", "alarm"

/// When something happened, for people: the time of day, "14:03:22.125", in this computer's time zone; of a session
/// that does not run by the clock its own seconds, "12.500".
/// @param unix_ns_at_zero of session time 0; 0: it does not run by the clock.
[[nodiscard]] std::string event_time(Time at, std::int64_t unix_ns_at_zero);

struct EventRow {
  std::uint64_t number = 0;  ///< Counts up from 1; never used twice.
  std::uint32_t run = 1;     ///< Which session: counts restarts.
  Time at{};                 ///< Of that session.
  Severity severity = Severity::kInfo;
  std::string code;           ///< Stable: "mode", "link_lost", ...
  std::string text;           ///< One line.
  bool acknowledged = false;  ///< Information needs none and has it from the start.
};

/// Empty text and kInfo: everything.
struct EventFilter {
  Severity least = Severity::kInfo;
  std::string text;  ///< In code or text, whatever the case.
  [[nodiscard]] bool hides_some() const noexcept { return least != Severity::kInfo || !text.empty(); }
  [[nodiscard]] bool lets_through(const EventRow& row) const;
};

class EventBook {
 public:
  static constexpr std::size_t kMost = 2000;

  /// @param most rows that it keeps: the oldest go first; what is not acknowledged, last.
  explicit EventBook(std::size_t most) : most_(most) {}
  EventBook() = default;

  /// @param bus of the machine. @param hand that the person has, for what there is to do with it.
  void add(const ConsoleEvent& event, const BusDescription& bus, HandSource hand = HandSource::kDevice);
  /// What the window itself has to say, such as a gamepad that is gone.
  void add(Time at, std::uint32_t run, Severity severity, const std::string& code, const std::string& text);
  /// Events that the loops had no room for; a row whenever it has grown. @param lost so far.
  void note_lost(Time at, std::uint32_t run, std::uint64_t lost);

  /// Oldest first.
  [[nodiscard]] const std::deque<EventRow>& rows() const noexcept { return rows_; }
  /// Oldest first; valid until something is added.
  [[nodiscard]] std::vector<const EventRow*> matching(const EventFilter& filter) const;
  /// Not acknowledged.
  [[nodiscard]] std::size_t open(Severity least) const noexcept;
  void acknowledge(std::uint64_t number) noexcept;
  void acknowledge(const EventFilter& filter);
  /// Rows dropped for want of room, and how many of them were not acknowledged.
  [[nodiscard]] std::uint64_t forgotten() const noexcept { return forgotten_; }
  [[nodiscard]] std::uint64_t forgotten_open() const noexcept { return forgotten_open_; }

  /// What the filter lets through, as CSV (RFC 4180); a file already there is kept beside it.
  /// @return where; empty: there was none. @throws InputError where it cannot be written, or the older one not be kept.
  std::string export_csv(const std::string& path, const EventFilter& filter = {}) const;

 private:
  std::size_t most_ = kMost;
  std::deque<EventRow> rows_;
  std::uint64_t numbered_ = 0, forgotten_ = 0, forgotten_open_ = 0, lost_ = 0;
};

// Notices in the loops' own step what to report to the person, and puts it where the window finds it when it has time.

using EventRing = Ring<ConsoleEvent, 512>;

/// What events come from; of a loop that runs, or of one that was recorded.
struct Watched {
  const SlaveMessage* machine = nullptr;  ///< Newest; nullptr: none was received.
  double silence_s = 0;
  bool stop = false;
  Reason device, warning;
  double force_most_N = std::numeric_limits<double>::infinity();  ///< That the person has set.
};
[[nodiscard]] inline Watched watched(const master::MasterLoop& master) noexcept {
  return {master.machine() ? &*master.machine() : nullptr, master.silence_s(), master.stop(), master.device().reason,
          master.warning()};
}

class EventWatch {
 public:
  /// @param ring outlives this; this is its only producer.
  explicit EventWatch(EventRing& ring) noexcept : ring_(ring) {}

  /// After every step. @param world of a simulated session; nullptr: there is none.
  void step(Time now, const Watched& side, const sim::WorldEventRing* world) noexcept;
  /// What happens in the loop around.
  void note(Time now, ConsoleEventKind kind, bool on, double value = 0, double limit = 0) noexcept;
  /// Another session from now on.
  void begin_anew() noexcept;
  [[nodiscard]] std::uint32_t run() const noexcept { return run_; }

 private:
  void watch_machine(Time now, const Watched& side) noexcept;
  void watch_force(Time now, const SlaveMessage& machine, double most_N) noexcept;
  void watch_standing(Time now, const Reason& reason) noexcept;
  void watch_operator(Time now, const Watched& side) noexcept;
  void watch_world(Time now, const sim::WorldEventRing& world) noexcept;

  /// What was reported last.
  struct Told {
    bool heard = false, contact = false, too_much = false, stop = false;
    Mode mode = Mode::kOff;
    Reason fault, reason, device{ReasonCode::kStartingUp, 0, 0, 0}, warning;
  };
  EventRing& ring_;
  std::uint32_t run_ = 1;
  Told told_;
  Reason standing_;
  Time standing_since_{};
  std::uint64_t world_read_ = 0;
};

}  // namespace knuckle::console
