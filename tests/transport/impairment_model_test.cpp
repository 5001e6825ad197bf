// The model's statistics against its settings. Bounds are four or more standard errors, seeds are fixed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "tests/support/no_alloc.h"
#include "transport/impaired_link.h"

namespace knuckle {
namespace {

constexpr std::size_t kBytes = 150;

/// One datagram every `period`; travel time in ms, below 0 where it was lost. Copies are left out.
std::vector<double> travels(const LinkImpairment& impairment, int count, Duration period = 2ms,
                            std::uint64_t seed = 1) {
  ImpairmentModel model(impairment, seed);
  std::vector<double> result;
  for (int i = 0; i < count; ++i) {
    const Time now(i * period);
    const auto fate = model.send(kBytes, now);
    result.push_back(fate.copies == 0 ? -1 : 1e3 * to_seconds(fate.arrivals[0] - now));
  }
  return result;
}

double quantile(std::vector<double> values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double correlation(const std::vector<double>& values, std::size_t lag) {
  const double middle = mean(values);
  double variance = 0, product = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    variance += (values[i] - middle) * (values[i] - middle);
    if (i >= lag) product += (values[i] - middle) * (values[i - lag] - middle);
  }
  return product / variance;
}

/// The values' places in their order: their correlation does not depend on the distribution's shape.
std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&values](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (std::size_t i = 0; i < order.size(); ++i) result[order[i]] = static_cast<double>(i);
  return result;
}

/// Mean length of the runs of lost ones, in datagrams.
double mean_burst(const std::vector<double>& travel) {
  int lost = 0, bursts = 0;
  for (std::size_t i = 0; i < travel.size(); ++i) {
    if (travel[i] >= 0) continue;
    ++lost;
    bursts += i == 0 || travel[i - 1] >= 0 ? 1 : 0;
  }
  return static_cast<double>(lost) / bursts;
}

double share_lost(const std::vector<double>& travel) {
  return static_cast<double>(std::count_if(travel.begin(), travel.end(), [](double t) { return t < 0; })) /
         static_cast<double>(travel.size());
}

LinkImpairment delayed(Duration delay) {
  LinkImpairment impairment;
  impairment.delay = delay;
  return impairment;
}

TEST(ImpairmentModel, UniformJitterStaysInItsBoundsWithItsDeviation) {
  LinkImpairment impairment = delayed(20ms);
  impairment.jitter = 10ms;
  const auto travel = travels(impairment, 10'000);
  EXPECT_GE(quantile(travel, 0), 10);
  EXPECT_LE(quantile(travel, 1), 30);
  for (const double q : {0.1, 0.5, 0.9}) EXPECT_NEAR(quantile(travel, q), 10 + 20 * q, 0.4);
  EXPECT_NEAR(correlation(travel, 1), 0, 0.05);
}

TEST(ImpairmentModel, NormalJitterHasItsMeanDeviationAndQuantilesAndNoMoreThanFourDeviations) {
  LinkImpairment impairment = delayed(100ms);
  impairment.jitter = 10ms;
  impairment.jitter_shape = JitterShape::kNormal;
  const auto travel = travels(impairment, 200'000);
  EXPECT_NEAR(mean(travel), 100, 0.1);
  EXPECT_NEAR(quantile(travel, 0.1587), 90, 0.2);
  EXPECT_NEAR(quantile(travel, 0.99), 100 + 23.26, 0.4);
  EXPECT_LE(quantile(travel, 1), 140);
  EXPECT_NEAR(correlation(travel, 1), 0, 0.01);
}

TEST(ImpairmentModel, ParetoJitterHasItsMeanAndALongTailToOneSide) {
  LinkImpairment impairment = delayed(100ms);
  impairment.jitter = 10ms;
  impairment.jitter_shape = JitterShape::kPareto;
  const auto travel = travels(impairment, 200'000);
  const auto expected = [](double q) { return 100 + 10 * (std::pow(1 - q, -1.0 / 3) - 1.5) / std::sqrt(0.75); };
  EXPECT_NEAR(mean(travel), 100, 0.2);
  EXPECT_NEAR(quantile(travel, 0), expected(0), 0.01);
  EXPECT_NEAR(quantile(travel, 0.5), expected(0.5), 0.2);
  EXPECT_NEAR(quantile(travel, 0.99), expected(0.99), 3);
  EXPECT_NEAR(quantile(travel, 0.999), expected(0.999), 12);
  EXPECT_LE(quantile(travel, 1), 100 + 250);
}

TEST(ImpairmentModel, SlowJitterKeepsItsShapeAndItsCorrelationTimeForAnySpacing) {
  for (const JitterShape shape : {JitterShape::kUniform, JitterShape::kNormal, JitterShape::kPareto}) {
    LinkImpairment impairment = delayed(200ms);
    impairment.slow_jitter = 20ms;
    impairment.slow_jitter_shape = shape;
    impairment.jitter_time = 200ms;
    for (const Duration period : {2ms, 20ms}) {
      const auto travel = travels(impairment, 400'000, period);
      const double median = shape == JitterShape::kPareto ? 200 + 20 * (std::cbrt(2) - 1.5) / std::sqrt(0.75) : 200;
      EXPECT_NEAR(quantile(travel, 0.5), median, 2.5) << static_cast<int>(shape);
      const auto expected = [&](std::size_t lag) {  // of the ranks of normal variates
        const double r = std::exp(-static_cast<double>(lag) * to_seconds(period) / 0.2);
        return 6 / std::numbers::pi * std::asin(r / 2);
      };
      const auto places = ranks(travel);
      for (const std::size_t lag : {std::size_t{1}, static_cast<std::size_t>(200ms / period)})
        EXPECT_NEAR(correlation(places, lag), expected(lag), 0.06) << static_cast<int>(shape);
    }
  }
}

TEST(ImpairmentModel, BurstLossHasItsShareAndItsMeanLengthAtAnyRate) {
  LinkImpairment impairment;
  impairment.burst_loss = {.mean_good = 950ms, .mean_bad = 50ms};
  for (const Duration period : {2ms, 5ms}) {
    const auto travel = travels(impairment, 500'000, period);
    EXPECT_NEAR(share_lost(travel), 0.05, 0.006);
    // A chain seen every T stays bad with q = b + (1 - b) exp(-T (1/good + 1/bad)), b = bad / (good + bad); a run of
    // such is 1 / (1 - q) long.
    const double b = 0.05, q = b + (1 - b) * std::exp(-to_seconds(period) * (1 / 0.95 + 1 / 0.05));
    EXPECT_NEAR(mean_burst(travel), 1 / (1 - q), 0.08 / (1 - q));
  }
}

TEST(ImpairmentModel, BurstLossTakesItsShareInGoodAndInBadTimes) {
  LinkImpairment impairment;
  impairment.burst_loss = {.mean_good = 300ms, .mean_bad = 100ms, .loss_in_good = 0.02, .loss_in_bad = 0.5};
  const auto travel = travels(impairment, 400'000);
  EXPECT_NEAR(share_lost(travel), 0.75 * 0.02 + 0.25 * 0.5, 0.008);
  ImpairmentModel model(impairment, 1);
  for (int i = 0; i < 1000; ++i) (void)model.send(kBytes, Time(i * 2ms));
  EXPECT_EQ(model.counts().lost_in_burst, model.counts().lost);
}

TEST(ImpairmentModel, RateLimitPassesItsRateAndDropsWhatItsQueueHasNoRoomFor) {
  LinkImpairment impairment = delayed(5ms);
  impairment.rate_Bps = 30'000;  // 150 bytes in 5 ms, sent every 2 ms
  impairment.queue_B = 3000;     // 100 ms
  ImpairmentModel model(impairment, 1);
  std::vector<Time> arrivals;
  for (int i = 0; i < 10'000; ++i) {
    const Time now(i * 2ms);
    const auto fate = model.send(kBytes, now);
    if (fate.copies == 0) continue;
    arrivals.push_back(fate.arrivals[0]);
    ASSERT_LE(fate.arrivals[0] - now, 105ms) << "no more than the queue holds";
  }
  const double rate_Bps = kBytes * static_cast<double>(arrivals.size() - 1) / to_seconds(arrivals.back() - arrivals[0]);
  EXPECT_NEAR(rate_Bps, 30'000, 1);
  EXPECT_TRUE(std::is_sorted(arrivals.begin(), arrivals.end()));
  EXPECT_EQ(model.counts().queue_full, 10'000 - arrivals.size());
  EXPECT_EQ(model.counts().lost, 0U);
  const auto later = model.send(kBytes, Time(30s));
  EXPECT_EQ(later.arrivals[0] - Time(30s), 10ms) << "an empty queue costs the time of sending alone";
}

TEST(ImpairmentModel, HoldsBackAsManyAsAskedWhichLaterOnesOvertake) {
  LinkImpairment impairment = delayed(20ms);
  impairment.reordering = 0.1;
  impairment.reorder_delay = 5ms;
  const auto travel = travels(impairment, 20'000);
  EXPECT_NEAR(static_cast<double>(std::count(travel.begin(), travel.end(), 25.0)), 2000, 4 * 42);
  EXPECT_EQ(std::count(travel.begin(), travel.end(), 20.0) + std::count(travel.begin(), travel.end(), 25.0), 20'000);
}

TEST(ImpairmentModel, NoneOvertakesWhereOrderIsKept) {
  LinkImpairment impairment = delayed(20ms);
  impairment.jitter = 15ms;
  impairment.jitter_shape = JitterShape::kPareto;
  for (const bool in_order : {false, true}) {
    impairment.in_order = in_order;
    const auto travel = travels(impairment, 5000);
    int overtaken = 0;
    for (std::size_t i = 1; i < travel.size(); ++i) overtaken += travel[i] + 2 < travel[i - 1] - 1e-6 ? 1 : 0;
    EXPECT_EQ(overtaken == 0, in_order) << overtaken;
  }
}

TEST(ImpairmentModel, OutagesComeAtTheirTimesAndAgainAfterTheirPeriod) {
  LinkImpairment impairment = delayed(1ms);
  impairment.outages = {{.from = Time(100ms), .length = 50ms},
                        {.from = Time(1s), .length = 20ms, .every = 200ms},
                        {.from = Time(1900ms)}};
  const auto travel = travels(impairment, 1000);
  for (std::size_t i = 0; i < travel.size(); ++i) {
    const auto ms = static_cast<int>(2 * i);
    const bool out = (ms >= 100 && ms < 150) || (ms >= 1000 && (ms - 1000) % 200 < 20) || ms >= 1900;
    EXPECT_EQ(travel[i] < 0, out) << ms;
  }
}

TEST(ImpairmentModel, RandomOutagesLoseEverythingForTheirLengthAtTheirRate) {
  LinkImpairment impairment;
  impairment.bursts_per_s = 1;
  impairment.burst_length = 50ms;
  const auto travel = travels(impairment, 50'000);  // 100 s
  EXPECT_NEAR(share_lost(travel), 0.05 / 1.05, 0.02);
  std::size_t run = 0;
  for (const double t : travel) {
    EXPECT_TRUE(t < 0 || run == 0 || run >= 24) << run;
    run = t < 0 ? run + 1 : 0;
  }
}

TEST(ImpairmentModel, CopiesComeAsOftenAsAskedAndASecondPathBringsThemAlsoOfWhatTheFirstLoses) {
  LinkImpairment copied;
  copied.duplication = 0.2;
  ImpairmentModel twice(copied, 1);
  for (int i = 0; i < 10'000; ++i) (void)twice.send(kBytes, Time(i * 2ms));
  EXPECT_NEAR(static_cast<double>(twice.counts().duplicated), 2000, 4 * 40);
  LinkImpairment both = delayed(5ms);
  both.second_path = 250ms;
  both.outages = {{.from = Time(100ms), .length = 200ms}};
  ImpairmentModel model(both, 1);
  for (int i = 0; i < 500; ++i) {
    const Time now(i * 2ms);
    const auto fate = model.send(kBytes, now);
    const bool out = i >= 50 && i < 150;
    ASSERT_EQ(fate.copies, out ? 1U : 2U) << i;
    EXPECT_EQ(fate.arrivals[0], now + 250ms) << i;
    EXPECT_TRUE(out || fate.arrivals[1] == now + 5ms) << i;
  }
}

TEST(ImpairmentModel, OutagesThatAreRareBeyondAllMeasureDoNotCome) {
  for (const double rare : {1e-12, 1e-300}) {
    LinkImpairment impairment;
    impairment.bursts_per_s = rare;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const std::vector<double> travel = travels(impairment, 100, 7ms, seed);
      EXPECT_EQ(share_lost(travel), 0) << rare << " a second, seed " << seed;
    }
  }
}

TEST(ImpairmentModel, ChangesReplaceAllOfADirectionAndKeepItsState) {
  LinkImpairment fast = delayed(10ms), slow = delayed(80ms);
  fast.loss = 0.5;
  slow.rate_Bps = 30'000;
  slow.queue_B = 3000;
  LinkImpairment plan = fast;
  plan.changes = {{Time(1s), slow}, {Time(2s), fast}};
  plan.outages = {{.from = Time(1500ms), .length = 100ms}};
  const auto travel = travels(plan, 1500);
  const auto part = [&](int from, int to) { return std::vector<double>(travel.begin() + from, travel.begin() + to); };
  EXPECT_NEAR(share_lost(part(0, 500)), 0.5, 0.09);
  EXPECT_GT(quantile(part(600, 700), 1), 80 + 90) << "a full queue";
  EXPECT_EQ(share_lost(part(750, 800)), 1) << "outages go on over changes";
  EXPECT_LE(quantile(part(1000, 1500), 1), 10);
}

TEST(ImpairmentModel, SameSeedSameFateAndNothingIsAllocated) {
  LinkImpairment impairment = delayed(20ms);
  impairment.jitter = impairment.slow_jitter = 5ms;
  impairment.jitter_shape = impairment.slow_jitter_shape = JitterShape::kPareto;
  impairment.burst_loss = {.mean_good = 100ms, .mean_bad = 20ms};
  impairment.rate_Bps = 70'000;
  impairment.queue_B = 5000;
  impairment.changes = {{Time(500ms), delayed(3ms)}};
  EXPECT_EQ(travels(impairment, 2000), travels(impairment, 2000));
  EXPECT_NE(travels(impairment, 200), travels(impairment, 200, 2ms, 2));
  ImpairmentModel model(impairment, 1);
  const test::NoAllocScope scope;
  for (int i = 0; i < 1000; ++i) (void)model.send(kBytes, Time(i * 2ms));
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
}

TEST(ImpairmentModel, RefusesSettingsThatAreImpossibleOrContradictEachOther) {
  const auto refused = [](void (*spoil)(LinkImpairment&)) {
    LinkImpairment impairment;
    spoil(impairment);
    EXPECT_THROW(ImpairmentModel(impairment, 1), InputError);
  };
  refused([](LinkImpairment& i) { i.loss = 1.5; });
  refused([](LinkImpairment& i) { i.delay = -1ms; });
  refused([](LinkImpairment& i) { i.second_path = -1ms; });
  refused([](LinkImpairment& i) { i.burst_loss.loss_in_bad = 2; });
  refused([](LinkImpairment& i) { i.burst_loss.mean_bad = 0ms; });
  refused([](LinkImpairment& i) { i.burst_loss.mean_good = -1ms; });
  refused([](LinkImpairment& i) { i.rate_Bps = -1; });
  refused([](LinkImpairment& i) {
    i.bursts_per_s = 1;
    i.burst_length = 0ms;
  });
  refused([](LinkImpairment& i) {
    i.in_order = true;
    i.reordering = 0.1;
  });
  refused([](LinkImpairment& i) { i.outages = {{.from = Time(), .length = 0ms}}; });
  refused([](LinkImpairment& i) { i.outages = {{.from = Time(), .length = 2s, .every = 1s}}; });
  refused([](LinkImpairment& i) { i.changes = {{Time(2s), {}}, {Time(1s), {}}}; });
  refused([](LinkImpairment& i) { i.address_changes = {Time(2s), Time(1s)}; });
  refused([](LinkImpairment& i) {
    LinkImpairment nested;
    nested.outages = {{}};
    i.changes = {{Time(2s), nested}};
  });
}

}  // namespace
}  // namespace knuckle
