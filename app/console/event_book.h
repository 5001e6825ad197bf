// What happened, for people: lines with time, severity and what to do, to filter, acknowledge and export.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "app/console/console_event.h"
#include "app/console/hand_input.h"
#include "core/time.h"

namespace knuckle::console {

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

  /// @param hand that the person has, for what there is to do with it.
  void add(const ConsoleEvent& event, HandSource hand = HandSource::kDevice);
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

}  // namespace knuckle::console
