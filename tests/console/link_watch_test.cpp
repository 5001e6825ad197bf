// What the Link screen tells, against links whose faults are known.
#include "app/console/link_watch.h"

#include <gtest/gtest.h>

#include "transport/impaired_link.h"

namespace knuckle::console {
namespace {

constexpr Duration kPeriod = 5ms;

/// A machine that answers every message at once.
struct WatchedLink {
  explicit WatchedLink(const LinkImpairment& impairment) : network({}, impairment, 5), watch(kPeriod) {}
  void run(double seconds) {
    for (const Time until = now + from_seconds(seconds); now < until;) {
      now += 1ms;
      network.advance(now);
      if (now.time_since_epoch() % kPeriod == Duration::zero()) {
        SlaveMessage message;
        message.stamp = {session, 1, ++sequence, now, now};
        network.b().send(encode(message).view());
      }
      watch.stamp(now);
      for (Datagram datagram; network.a().receive(datagram);) watch.note(*decode_slave(datagram.view()));
    }
  }
  ImpairedLink network;
  LinkWatch watch;
  Time now{};
  std::uint64_t session = 5;
  std::uint32_t sequence = 0;
};

LinkImpairment delayed(Duration delay) {
  LinkImpairment impairment;
  impairment.delay = delay;
  return impairment;
}

TEST(LinkWatch, ASteadyLinkHasItsDelayNoJitterAndNoLoss) {
  WatchedLink rig(delayed(30ms));
  rig.run(5);
  EXPECT_NEAR(to_seconds(rig.watch.round_trip().quantile(0.5)), 0.030, 0.004);
  EXPECT_EQ(rig.watch.arrival_jitter().max(), Duration::zero());
  EXPECT_EQ(rig.watch.loss(), 0);
}

TEST(LinkWatch, JitterAndLateMessagesAreNoLoss) {
  LinkImpairment impairment = delayed(30ms);
  impairment.jitter = 20ms;
  impairment.reordering = 0.1;
  WatchedLink rig(impairment);
  rig.run(10);
  EXPECT_LT(rig.watch.loss(), 0.005);
  EXPECT_GT(to_seconds(rig.watch.arrival_jitter().quantile(0.5)), 0.003);
  EXPECT_LT(to_seconds(rig.watch.arrival_jitter().quantile(0.99)), 0.05);
}

TEST(LinkWatch, CopiesHideNoLossAndAreNoRoundTripsOfTheirOwn) {
  for (const double loss : {0.0, 0.2}) {
    LinkImpairment impairment = delayed(10ms);
    impairment.loss = loss;
    impairment.duplication = 0.5;
    impairment.reorder_delay = 40ms;  // of the copies
    WatchedLink rig(impairment);
    rig.run(10);
    EXPECT_NEAR(rig.watch.loss(), loss, 0.03);
    EXPECT_NEAR(to_seconds(rig.watch.round_trip().quantile(0.99)), 0.010, 0.002);
  }
}

TEST(LinkWatch, LossGrowsInASilenceToAllOfIt) {
  LinkImpairment impairment = delayed(10ms);
  impairment.outages = {{.from = Time(20s)}};
  WatchedLink rig(impairment);
  rig.run(20);
  EXPECT_EQ(rig.watch.loss(), 0);
  for (const double silent_s : {1.0, 3.0, 5.0, 9.0}) {
    rig.run(silent_s + 20 - to_seconds(rig.now));
    EXPECT_NEAR(rig.watch.loss(), silent_s / 10, 0.01);
  }
  rig.run(60);
  EXPECT_EQ(rig.watch.loss(), 1);
}

TEST(LinkWatch, ALongSilenceIsLossOfTheLastTenSecondsAfterItToo) {
  LinkImpairment impairment = delayed(10ms);
  impairment.outages = {{.from = Time(20s), .length = 4s}};
  WatchedLink rig(impairment);
  rig.run(26);
  EXPECT_NEAR(rig.watch.loss(), 0.4, 0.01);
  rig.run(6);
  EXPECT_NEAR(rig.watch.loss(), 0.2, 0.01);
  rig.run(3);
  EXPECT_EQ(rig.watch.loss(), 0);
  EXPECT_EQ(rig.watch.arrival_jitter().max(), Duration::zero());
}

TEST(NumbersSeen, CountsEachNumberOnceWhereverTheSequenceWrapsAndHoweverFarItJumps) {
  NumbersSeen numbers;
  EXPECT_EQ(numbers.missing(100, 0), 0) << "nothing is known yet";
  constexpr std::uint32_t kFirst = 0xFFFFFFF0;
  numbers.begin(kFirst);
  using Arrival = NumbersSeen::Arrival;
  EXPECT_EQ(numbers.add(kFirst - 1), Arrival::kAgain) << "from before the first";
  for (std::uint32_t i = 2; i < 40; i += 2) EXPECT_EQ(numbers.add(kFirst + i), Arrival::kNewest);
  EXPECT_DOUBLE_EQ(numbers.missing(1000, 0), 19.0 / 39);
  EXPECT_EQ(numbers.add(kFirst + 1), Arrival::kLate);
  EXPECT_EQ(numbers.add(kFirst + 1), Arrival::kAgain);
  EXPECT_DOUBLE_EQ(numbers.missing(1000, 0), 18.0 / 39);
  EXPECT_DOUBLE_EQ(numbers.missing(1000, 11), 29.0 / 50);
  EXPECT_EQ(numbers.add(kFirst + 1'000'000), Arrival::kNewest);
  EXPECT_DOUBLE_EQ(numbers.missing(1000, 0), 0.999);
}

TEST(LinkWatch, AMachineThatBeginsItsNumbersAnewIsNoLoss) {
  WatchedLink rig(delayed(1ms));
  rig.run(3);
  rig.sequence = 0;
  ++rig.session;
  rig.now += 2s;  // as long as a restart takes
  rig.run(3);
  EXPECT_EQ(rig.watch.loss(), 0);
}

TEST(LinkWatch, HandToValveIsWhatTheStatusSaysWithoutItsWayBack) {
  LinkImpairment impairment = delayed(20ms);
  impairment.jitter = 10ms;  // the quickest of the answers took 10 ms
  WatchedLink rig(impairment);
  rig.run(5);
  MachineStatus status;
  rig.watch.note(status);  // nobody leads
  EXPECT_EQ(rig.watch.hand_to_valve().count(), 0u);
  status.acted_report_at = rig.now - 60ms;
  status.acted_ago = 15ms;
  rig.watch.note(status);
  EXPECT_NEAR(to_seconds(rig.watch.hand_to_valve().max()), 0.060 - 0.015 - 0.010 / 2, 0.001);
}

}  // namespace
}  // namespace knuckle::console
