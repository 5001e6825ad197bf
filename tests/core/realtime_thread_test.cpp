#include "core/realtime_thread.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <vector>

#include "core/mailbox.h"

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
}

TEST(PeriodicSchedule, AStepThatEndsOnTheNextPeriodMissedIt) {
  PeriodicSchedule schedule(at(0ms), 1ms);
  schedule.advance(at(1ms));
  EXPECT_EQ(schedule.next(), at(2ms));
  EXPECT_EQ(schedule.skipped(), 1u);
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

TEST(RealtimeThread, SkipsWhatASlowStepMissed) {
  const RealtimeClock clock;
  std::atomic<int> steps{0};
  RealtimeThread thread({.name = "slow", .period = 1ms}, clock, [&](Time now) {
    if (steps++ == 2) clock.sleep_until(now + 10ms);
  });
  while (steps < 6) clock.sleep_until(clock.now() + 1ms);
  thread.stop();
  EXPECT_GE(thread.report().overruns, 9u);
  EXPECT_GE(thread.report().execution.max(), 10ms);
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

TEST(RealtimeThread, HandsItsStateOverByMailbox) {
  const RealtimeClock clock;
  Mailbox<std::uint64_t> ping, pong;
  std::uint64_t sent = 0, echoed = 0;
  RealtimeThread one({.name = "one", .period = 200us}, clock, [&](Time) {
    pong.take(echoed);
    ping.put(++sent);
  });
  std::uint64_t heard = 0;
  std::atomic<std::uint64_t> rounds{0};
  RealtimeThread other({.name = "other", .period = 300us}, clock, [&](Time) {
    if (!ping.take(heard)) return;
    pong.put(heard);
    ++rounds;
  });
  while (rounds < 50) clock.sleep_until(clock.now() + 1ms);
  other.stop();
  one.stop();
  EXPECT_LE(echoed, sent);
  EXPECT_GE(heard, 50u);
}

}  // namespace
}  // namespace knuckle
