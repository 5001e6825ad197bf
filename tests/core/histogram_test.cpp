#include "core/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/recent_histogram.h"
#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

TEST(Histogram, CountsWhatLiesBelowAnEdge) {
  Histogram histogram;
  for (const Duration value : std::initializer_list<Duration>{10ns, 100ns, 1us, 1us, 1ms}) histogram.add(value);
  EXPECT_EQ(histogram.count_below(64ns), 1u);
  EXPECT_EQ(histogram.count_below(128ns), 2u);
  EXPECT_EQ(histogram.count_below(960ns), 2u);   // the bin of 1 us begins here
  EXPECT_EQ(histogram.count_below(1024ns), 4u);  // and ends here
  EXPECT_EQ(histogram.count_below(1s), 5u);
}

TEST(Histogram, QuantilesAreRightToAnEighthAndNeverTooSmall) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> duration_ns(11, 2.5);  // 60 us, from ns to s
  Histogram histogram;
  std::vector<std::int64_t> values(20'000);
  for (std::int64_t& value : values) {
    value = static_cast<std::int64_t>(duration_ns(random));
    histogram.add(Duration(value));
  }
  std::sort(values.begin(), values.end());
  for (const double q : {0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(values.size()))) - 1;
    const auto exact = static_cast<double>(values[rank]);
    const auto read = static_cast<double>(histogram.quantile(q).count());
    EXPECT_GE(read, exact) << "q " << q;
    EXPECT_LE(read, exact * 1.126 + 64) << "q " << q;
  }
  EXPECT_EQ(histogram.max().count(), values.back());
  EXPECT_EQ(histogram.quantile(1).count(), values.back());
}

TEST(Histogram, TakesWhatLiesOutsideItsBins) {
  Histogram histogram;
  EXPECT_EQ(histogram.quantile(0.99), Duration::zero()) << "nothing was added yet";
  histogram.add(-5ms);
  EXPECT_EQ(histogram.quantile(1), Duration::zero());
  histogram.add(100s);
  EXPECT_EQ(histogram.count(), 2u);
  EXPECT_EQ(histogram.quantile(1), 100s);
}

TEST(Histogram, MergeEqualsAddingToOne) {
  Histogram a, b, both;
  for (int i = 1; i < 1000; ++i) {
    const Duration value = i * 1us;
    (i % 3 == 0 ? a : b).add(value);
    both.add(value);
  }
  a.merge(b);
  EXPECT_EQ(a.count(), both.count());
  EXPECT_EQ(a.max(), both.max());
  for (const double q : {0.1, 0.5, 0.99}) EXPECT_EQ(a.quantile(q), both.quantile(q));
}

TEST(Histogram, AllocatesNothing) {
  Histogram histogram;
  test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) histogram.add(i * 1us);
  EXPECT_EQ(scope.allocations(), 0u);
}

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
