// How a periodic loop keeps its time, reported while it runs.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "core/histogram.h"
#include "core/mailbox.h"
#include "core/recent_histogram.h"
#include "core/time.h"

namespace knuckle {

struct LoopHealth {
  std::array<char, 24> policy{};   ///< Scheduling class granted, ends with 0: "SCHED_FIFO 80", "SCHED_OTHER"
  std::uint8_t fifo_priority = 0;  ///< Granted; 0: no real-time class.
  Duration period{};
  std::uint64_t steps = 0, overruns = 0;  ///< Since its start; overruns: periods skipped.
  Histogram wake_lateness, execution;     ///< Of the last 10 s.
};

/// Gathers it in the loop's thread, between the steps, and reports to one reader four times a second.
class LoopHealthMeter {
 public:
  static constexpr Duration kTold = 250ms;

  /// @param to outlives this. @param policy cut to what LoopHealth has room for.
  LoopHealthMeter(Mailbox<LoopHealth>& to, std::string_view policy, int fifo_priority, Duration period) noexcept
      : to_(to) {
    std::copy_n(policy.begin(), std::min(policy.size(), health_.policy.size() - 1), health_.policy.begin());
    health_.fifo_priority = static_cast<std::uint8_t>(fifo_priority);
    health_.period = period;
  }

  /// After every step. @param overruns so far.
  void note(Time done, Duration wake_lateness, Duration execution, std::uint64_t overruns) noexcept {
    wake_lateness_.add(done, wake_lateness);
    execution_.add(done, execution);
    ++health_.steps;
    health_.overruns = overruns;
    if (done - told_at_ < kTold) return;
    told_at_ = done;
    health_.wake_lateness = wake_lateness_.recent(done);
    health_.execution = execution_.recent(done);
    to_.put(health_);
  }

 private:
  Mailbox<LoopHealth>& to_;
  LoopHealth health_;
  RecentHistogram wake_lateness_, execution_;
  Time told_at_ = kNever;
};

}  // namespace knuckle
