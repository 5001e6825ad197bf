#include "core/loop_health.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <string>

#include "core/realtime_thread.h"
#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

TEST(LoopHealthMeter, TellsAtOnceAndThenFourTimesASecond) {
  Mailbox<LoopHealth> mailbox;
  LoopHealthMeter meter(mailbox, "SCHED_FIFO 80", 80, 5ms);
  LoopHealth health;
  int told = 0;
  for (int step = 1; step <= 400; ++step) {  // 2 s
    meter.note(Time(step * 5ms), 10us, 100us, 0);
    if (mailbox.take(health)) ++told;
    if (step == 1) {
      EXPECT_EQ(told, 1);
    }
  }
  EXPECT_EQ(told, 8);
  EXPECT_EQ(std::string(health.policy.data()), "SCHED_FIFO 80");
  EXPECT_EQ(health.fifo_priority, 80);
  EXPECT_EQ(health.period, 5ms);
  EXPECT_EQ(health.steps, 351U) << "as of the last time it told";
}

TEST(LoopHealthMeter, CountsAllStepsButTimesOnlyTheRecentOnes) {
  Mailbox<LoopHealth> mailbox;
  LoopHealthMeter meter(mailbox, "SCHED_OTHER", 0, 1ms);
  for (int step = 1; step <= 60'000; ++step) {
    const bool early = step <= 1000;
    meter.note(Time(step * 1ms), early ? 5ms : 20us, early ? 3ms : 100us, early ? 0 : 7);
  }
  LoopHealth health;
  ASSERT_TRUE(mailbox.take(health));
  EXPECT_GT(health.steps, 59'000U);
  EXPECT_EQ(health.overruns, 7U);
  EXPECT_LE(health.wake_lateness.count(), 10'000U);
  EXPECT_GE(health.wake_lateness.count(), 9'000U);
  EXPECT_EQ(health.wake_lateness.max(), 20us);
  EXPECT_EQ(health.execution.max(), 100us);
}

TEST(LoopHealthMeter, CutsAPolicyThatIsTooLongAndAllocatesNothing) {
  Mailbox<LoopHealth> mailbox;
  const std::string name(100, 'x');
  const test::NoAllocScope scope;
  LoopHealthMeter meter(mailbox, name, 0, 1ms);
  for (int step = 1; step <= 1000; ++step) meter.note(Time(step * 1ms), 1us, 1us, 0);
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
  LoopHealth health;
  ASSERT_TRUE(mailbox.take(health));
  EXPECT_EQ(std::string(health.policy.data()), std::string(23, 'x'));
}

TEST(RealtimeThread, TellsHowItRunsWhileItRuns) {
  const RealtimeClock clock;
  Mailbox<LoopHealth> mailbox;
  std::atomic<int> steps{0};
  RealtimeThread thread({.name = "told", .period = 1ms, .health = &mailbox}, clock, [&](Time now) {
    if (++steps == 3) clock.sleep_until(now + 10ms);
  });
  LoopHealth health;
  // A computer that is busy makes overruns of its own, also before the third step.
  while (!mailbox.take(health) || health.overruns < 9 || health.steps < 4) clock.sleep_until(clock.now() + 1ms);
  const std::optional<std::string> granted = thread.granted();
  thread.stop();
  EXPECT_EQ(granted, std::string(health.policy.data()));
  EXPECT_EQ(health.period, 1ms);
  EXPECT_GE(health.steps, 4U);
  EXPECT_LE(health.steps, thread.report().steps);
  EXPECT_GT(health.execution.count(), 0U);
  EXPECT_LE(health.execution.count(), health.steps);
  EXPECT_GE(health.execution.max(), 10ms);
}

}  // namespace
}  // namespace knuckle
