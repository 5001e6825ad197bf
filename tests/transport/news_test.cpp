// What counts as news after reordering, silences, late copies and restarts of either side.
#include "transport/news.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace knuckle {
namespace {

constexpr bool kHeard = false, kSilent = true;

MasterMessage message(std::uint32_t sequence, Time sent_at, Time echoed) {
  MasterMessage m;
  m.sequence = sequence;
  m.sent_at = sent_at;
  m.echoed_slave_time = echoed;
  return m;
}

/// At the receiver's 100 s: a sender whose clock shows 50 s, on a path of 10 ms each way.
class Receiver {
 public:
  bool take(const MasterMessage& m, Time now, bool silent) { return news_.take(m, m.echoed_slave_time, now, silent); }
  /// Number n of a life whose clock showed `clock` at 100 s; sent 2 ms apart.
  static MasterMessage of_life(Time clock, std::uint32_t n) {
    return message(n, clock + n * 2ms, Time(100s) + n * 2ms - 10ms);
  }

 private:
  News news_;
};

TEST(News, NewestNumberWins) {
  Receiver r;
  const auto m = [](std::uint32_t n) { return Receiver::of_life(Time(50s), n); };
  EXPECT_TRUE(r.take(m(1000), Time(102s), kSilent)) << "the first is always news";
  EXPECT_TRUE(r.take(m(1001), Time(102s), kHeard));
  EXPECT_FALSE(r.take(m(1001), Time(102s), kHeard));
  EXPECT_FALSE(r.take(m(1000), Time(102s), kHeard));
  EXPECT_TRUE(r.take(m(1100), Time(103s), kHeard));
  EXPECT_FALSE(r.take(m(1050), Time(103s), kHeard));
}

TEST(News, LateCopyIsNoneHoweverLongTheSilence) {
  Receiver r;
  const auto m = [](std::uint32_t n) { return Receiver::of_life(Time(50s), n); };
  ASSERT_TRUE(r.take(m(1000), Time(102s), kHeard));
  for (std::uint32_t n = 1; n <= 1000; ++n) EXPECT_FALSE(r.take(m(n), Time(1000s), kSilent)) << n;
  EXPECT_TRUE(r.take(m(1001), Time(1000s), kSilent)) << "never heard and newer: news, how old its round trip tells";
}

// An older message may echo more than a later one, as the later may have been held for less; never by more than is
// held.
TEST(News, LateCopyIsNoneWithAnyEchoThatAnEarlierMessageCanHave) {
  for (Duration held = -40ms; held <= 40ms; held += 100us) {
    Receiver r;
    const Time echo(100s);
    ASSERT_TRUE(r.take(message(1000, Time(50s), echo), Time(101s), kHeard));
    EXPECT_EQ(r.take(message(999, Time(50s) - 2ms, echo + held), Time(102s), kSilent), held > kMostHeld)
        << to_seconds(held);
  }
}

TEST(News, SenderThatBeganAnewIsTakenOnceItHasHeardMoreThanAnyMessageBefore) {
  Receiver r;
  ASSERT_TRUE(r.take(message(5000, Time(50s), Time(100s)), Time(100s) + 10ms, kHeard));
  EXPECT_FALSE(r.take(message(1, Time(1ms), Time{}), Time(102s), kSilent)) << "it has heard nothing yet";
  EXPECT_FALSE(r.take(message(20, Time(40ms), Time(102s)), Time(102s), kHeard)) << "the one before is still there";
  EXPECT_TRUE(r.take(message(20, Time(40ms), Time(102s)), Time(102s), kSilent));
  EXPECT_TRUE(r.take(message(21, Time(42ms), Time(102s)), Time(102s), kHeard));
}

TEST(News, StragglersOfALifeBeforeAreNoneWhateverTheirNumbersAndStamps) {
  Receiver r;
  ASSERT_TRUE(r.take(message(5000, Time(50s), Time(100s)), Time(100s) + 10ms, kHeard));
  ASSERT_TRUE(r.take(message(20, Time(40ms), Time(102s)), Time(102s), kSilent));
  EXPECT_FALSE(r.take(message(5010, Time(50s) + 20ms, Time(100s) + 30ms), Time(102s), kHeard));
  EXPECT_FALSE(r.take(message(5010, Time(50s) + 20ms, Time(100s) + 30ms), Time(110s), kSilent));
  EXPECT_FALSE(r.take(message(30, Time(60ms), Time{}), Time(110s), kSilent)) << "of before it heard anything";
  EXPECT_TRUE(r.take(message(21, Time(42ms), Time(102s)), Time(110s), kSilent));
}

TEST(News, NumberBeyondTheHalfOfAllIsNotTakenForALaterOneOfTheSameLife) {
  Receiver r;
  ASSERT_TRUE(r.take(message(3'000'000'000U, Time(6'000'000s), Time(100s)), Time(100s), kHeard));
  ASSERT_TRUE(newer(1, 3'000'000'000U));
  EXPECT_FALSE(r.take(message(1, Time(2ms), Time(102s)), Time(102s), kHeard));
  EXPECT_TRUE(r.take(message(1, Time(2ms), Time(102s)), Time(102s), kSilent)) << "but as one that began anew";
}

TEST(News, EchoesOfAFormerLifeOfOursTellNothing) {
  Receiver r;
  const Time now(1s);
  EXPECT_TRUE(r.take(message(700, Time(50s), Time(300s)), now, kSilent)) << "it still echoes what we were";
  EXPECT_TRUE(r.take(message(701, Time(50s) + 2ms, Time(300s)), now, kHeard));
  EXPECT_TRUE(r.take(message(702, Time(50s) + 4ms, now - 10ms), now, kHeard)) << "and then what we are";
  EXPECT_FALSE(r.take(message(701, Time(50s) + 2ms, Time(300s)), Time(5s), kSilent));
}

TEST(News, SenderThatHasNeverHeardUsIsStillInOrder) {
  Receiver r;
  ASSERT_TRUE(r.take(message(100, Time(50s), Time{}), Time(100s), kHeard));
  EXPECT_TRUE(r.take(message(101, Time(50s) + 2ms, Time{}), Time(100s), kHeard));
  EXPECT_FALSE(r.take(message(100, Time(50s), Time{}), Time(101s), kSilent));
  EXPECT_TRUE(r.take(message(102, Time(50s) + 4ms, Time(101s)), Time(101s), kHeard));
}

// Whatever the network does with the order, each message at most once, none before a newer one: also over silences.
TEST(News, RandomDeliveryNeverGoesBack) {
  std::mt19937 rng(5);
  const auto draw = [&rng](int most) { return std::uniform_int_distribution<>(0, most)(rng); };
  for (int run = 0; run < 200; ++run) {
    Receiver r;
    std::uint32_t newest = 0;
    for (int i = 0; i < 500; ++i) {
      const auto n = static_cast<std::uint32_t>(std::max(1, i - draw(300)));
      const bool taken = r.take(Receiver::of_life(Time(50s), n), Time(100s) + i * 2ms, draw(1) == 1);
      EXPECT_EQ(taken, n > newest) << n;
      if (taken) newest = n;
    }
    EXPECT_GT(newest, 400U);
  }
}

}  // namespace
}  // namespace knuckle
