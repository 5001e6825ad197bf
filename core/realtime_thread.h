// The one class that knows about real time: scheduling class, memory locking, absolute sleeps, and how late
// and how long every step was. Loops themselves see only step(now).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "core/histogram.h"
#include "core/loop_health.h"
#include "core/mailbox.h"
#include "core/time.h"

namespace knuckle {

/// Session time of a process that runs in real time: CLOCK_MONOTONIC since construction. Copies agree.
class RealtimeClock {
 public:
  /// @param now what it reads now.
  explicit RealtimeClock(Time now = {}) noexcept;
  [[nodiscard]] Time now() const noexcept;
  void sleep_until(Time wake) const noexcept;

 private:
  std::int64_t epoch_ns_;
};

/// When a periodic loop runs next. A period that was missed is skipped and counted, never caught up in a burst.
class PeriodicSchedule {
 public:
  PeriodicSchedule(Time first, Duration period) noexcept : next_(first), period_(period) {}
  [[nodiscard]] Time next() const noexcept { return next_; }
  [[nodiscard]] std::uint64_t skipped() const noexcept { return skipped_; }
  /// After a step that ended at done: on to the first period that still lies ahead.
  void advance(Time done) noexcept;

 private:
  Time next_;
  Duration period_;
  std::uint64_t skipped_ = 0;
};

/// Asks for SCHED_FIFO at this priority (1..99) for the calling thread. Where that is not granted, nothing changes.
void ask_for_fifo(int priority) noexcept;

struct RealtimeOptions {
  std::string name;          ///< As top and gdb show it; 15 characters.
  Duration period{};         ///< > 0
  Duration phase{};          ///< Steps are due so long after multiples of the period; [0, period).
  int fifo_priority = 0;     ///< 1..99 asks for SCHED_FIFO; 0 does not.
  bool lock_memory = false;  ///< Asks that no page of the process be swapped out.
  /// Updated four times a second, from the first step on, with how the loop runs; outlives the thread. Null: unused.
  Mailbox<LoopHealth>* health = nullptr;
};

/// What the operating system granted, and what came of it.
struct RealtimeReport {
  std::string policy = "not run";  ///< "SCHED_FIFO 80", "SCHED_OTHER"
  bool memory_locked = false;
  std::uint64_t steps = 0;
  std::uint64_t overruns = 0;  ///< Periods skipped because a step ended, or began, too late.
  Histogram wake_lateness;
  Histogram execution;
};

/// Calls step(now) every period, phase after multiples of the period of the clock, in a thread of its own from
/// construction to stop(). What the system does not grant is reported, not an error.
class RealtimeThread {
 public:
  /// @param step must not throw (the process would end), nor touch what another thread touches.
  RealtimeThread(RealtimeOptions options, const RealtimeClock& clock, std::function<void(Time)> step);
  ~RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  /// Waits for the step that runs now, if any. May be called again.
  void stop();
  /// The scheduling class granted, and whether memory was asked to be locked and is not, as soon as the thread has
  /// begun; any thread.
  [[nodiscard]] std::optional<std::string> granted() const;
  /// Of the whole run: valid after stop().
  [[nodiscard]] const RealtimeReport& report() const noexcept { return report_; }

 private:
  void run() noexcept;

  RealtimeOptions options_;
  RealtimeClock clock_;
  std::function<void(Time)> step_;
  RealtimeReport report_;
  std::atomic<bool> stop_{false}, begun_{false};
  std::thread thread_;  ///< Last: everything above exists when it starts.
};

}  // namespace knuckle
