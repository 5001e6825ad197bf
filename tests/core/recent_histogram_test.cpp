#include "core/recent_histogram.h"

#include <gtest/gtest.h>

#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

TEST(RecentHistogram, HoldsTheWindowThatEndsNowToATenth) {
  RecentHistogram recent(10s);
  for (Time at{}; at < Time(60s); at += 100ms) {
    recent.add(at, Duration(at.time_since_epoch().count() / 1000));
    const Histogram held = recent.recent(at);
    const auto full = static_cast<std::uint64_t>(at.time_since_epoch() / 100ms) + 1;
    EXPECT_GE(held.count(), std::min<std::uint64_t>(full, 91)) << to_seconds(at);
    EXPECT_LE(held.count(), std::min<std::uint64_t>(full, 100)) << to_seconds(at);
    EXPECT_EQ(held.max(), Duration(at.time_since_epoch().count() / 1000));
  }
}

TEST(RecentHistogram, ForgetsAPeakOnceItIsOld) {
  RecentHistogram recent(10s);
  recent.add(Time(5s), 3s);
  recent.add(Time(14s), 1ms);
  EXPECT_EQ(recent.recent(Time(14s)).max(), 3s);
  EXPECT_EQ(recent.recent(Time(15s)).max(), 1ms);
  EXPECT_EQ(recent.recent(Time(15s)).count(), 1U);
}

TEST(RecentHistogram, IsEmptyAfterASilenceOfAnyLength) {
  RecentHistogram recent(10s);
  EXPECT_EQ(recent.recent(Time(0s)).count(), 0U) << "nothing was added yet";
  for (int s = 0; s < 20; ++s) recent.add(Time(s * 1s), 1ms);
  EXPECT_EQ(recent.recent(Time(29s)).count(), 0U);
  EXPECT_EQ(recent.recent(Time(3600s)).count(), 0U);
  recent.add(Time(3600s), 2ms);
  EXPECT_EQ(recent.recent(Time(3600s)).count(), 1U);
}

TEST(RecentHistogram, AllocatesNothing) {
  RecentHistogram recent;
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) recent.add(Time(i * 300ms), 1us);
  const auto count = recent.recent(Time(30s)).count();
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
  EXPECT_GT(count, 0U);
}

}  // namespace
}  // namespace knuckle
