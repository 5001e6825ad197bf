#include "core/realtime_thread.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <vector>

namespace knuckle {
namespace {

Time at(Duration since_start) {
  return Time(since_start);
}

TEST(PeriodicSchedule, KeepsItsGridWhenStepsEndInTime) {
  PeriodicSchedule schedule(at(10ms), 1ms);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(schedule.next(), at(10ms + i * 1ms));
    schedule.advance(schedule.next() + 999us);
  }
  EXPECT_EQ(schedule.skipped(), 0u);
}

TEST(PeriodicSchedule, SkipsAndCountsMissedPeriodsInsteadOfABurst) {
  PeriodicSchedule schedule(at(10ms), 1ms);
  schedule.advance(at(13ms + 200us));  // The periods at 11, 12 and 13 ms passed meanwhile.
  EXPECT_EQ(schedule.next(), at(14ms));
  EXPECT_EQ(schedule.skipped(), 3u);
  schedule.advance(at(14ms + 100us));
  EXPECT_EQ(schedule.next(), at(15ms));
  EXPECT_EQ(schedule.skipped(), 3u);
  schedule.advance(at(16ms));  // one that ends on the next period has missed it
  EXPECT_EQ(schedule.next(), at(17ms));
  EXPECT_EQ(schedule.skipped(), 4u);
}

TEST(RealtimeThread, StepsNeverEarlyAndAtMostOncePerPeriod) {
  const RealtimeClock clock;
  std::vector<Time> calls;
  calls.reserve(1000);
  std::atomic<int> steps{0};
  RealtimeThread thread({.name = "test", .period = 1ms}, clock, [&](Time now) {
    if (calls.size() < calls.capacity()) calls.push_back(now);
    ++steps;
  });
  while (steps < 20) clock.sleep_until(clock.now() + 1ms);
  thread.stop();
  for (std::size_t i = 1; i < calls.size(); ++i) {
    EXPECT_GT(calls[i].time_since_epoch() / 1ms, calls[i - 1].time_since_epoch() / 1ms);
  }
  const RealtimeReport& report = thread.report();
  EXPECT_EQ(report.steps, static_cast<std::uint64_t>(steps));
  EXPECT_EQ(report.wake_lateness.count(), report.steps);
  EXPECT_EQ(report.execution.count(), report.steps);
}

TEST(RealtimeThread, ReportsTheClassItWasGranted) {
  const RealtimeClock clock;
  std::atomic<int> policy{-1};
  RealtimeThread thread({.name = "fifo", .period = 1ms, .fifo_priority = 10}, clock,
                        [&](Time) { policy = sched_getscheduler(0); });
  while (policy < 0) clock.sleep_until(clock.now() + 1ms);
  thread.stop();
  EXPECT_EQ(thread.report().policy, policy == SCHED_FIFO ? "SCHED_FIFO 10" : "SCHED_OTHER");
}

}  // namespace
}  // namespace knuckle
