// Whom a side follows, what of that is news and how late it is: after reordering, silences, late copies, recordings,
// and restarts of either side.
#include "transport/link_session.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace knuckle {
namespace {

using Verdict = LinkSession::Verdict;

constexpr LinkStart kHere{11, 2h}, kThere{5, 3h};
constexpr Duration kSilence = 200ms;

/// This side, at its 100 s; a far side whose clock shows 50 s then, on a path of 10 ms each way.
class Conversation {
 public:
  LinkSession here{kHere, kSilence};
  /// Number n of the far side's session, sent at 100 s + 2 ms n and heard 10 ms later; it echoes what was sent 20 ms
  /// before it is heard.
  static LinkStamp message(std::uint32_t n, std::uint64_t session = kThere.session) {
    const Duration at = n * 2ms;
    return {session, kHere.session, n, Time(50s) + kThere.origin + at, Time(100s) + kHere.origin + at - 10ms};
  }
  static Time arrival(std::uint32_t n) { return Time(100s) + n * 2ms + 10ms; }
  Verdict take(std::uint32_t n, std::uint64_t session = kThere.session) { return take_at(arrival(n), n, session); }
  Verdict take_at(Time arrived, std::uint32_t n, std::uint64_t session = kThere.session) {
    LinkStamp stamp = message(n, session);
    return here.take(stamp, arrived);
  }
};

TEST(LinkSession, TwoSidesFindEachOtherAndThenEachHearsTheOther) {
  LinkSession a(kHere, kSilence), b(kThere, kSilence);
  LinkStamp stamp = a.stamp(1, Time(1s));
  EXPECT_EQ(b.take(stamp, Time(500s)), Verdict::kForeign) << "it has heard nobody";
  stamp = b.stamp(1, Time(500s) + 5ms);
  EXPECT_EQ(stamp.echoed_session, kHere.session);
  EXPECT_EQ(a.take(stamp, Time(1s) + 7ms), Verdict::kBegins);
  EXPECT_EQ(stamp.echoed, Time(1s) + 5ms) << "own clock: sent, and held for 5 ms";
  EXPECT_EQ(a.far(), kThere.session);
  stamp = a.stamp(2, Time(1s) + 8ms);
  EXPECT_EQ(b.take(stamp, Time(500s) + 10ms), Verdict::kBegins);
  EXPECT_EQ(b.far(), kHere.session);
}

TEST(LinkSession, StampsCountFromADrawnOrigin) {
  LinkSession a(kHere, kSilence);
  EXPECT_EQ(a.stamp(1, Time(1s)).sent_at, Time(1s) + 2h);
  EXPECT_EQ(a.to_link(Time(1s)), Time(1s) + 2h);
  EXPECT_EQ(a.from_link(Time(1s) + 2h), Time(1s));
  EXPECT_EQ(a.to_link(kNever), kNever);
  EXPECT_EQ(a.from_link(kNever), kNever);
}

TEST(LinkSession, StartsAreDrawnAndOnVirtualTimeRepeat) {
  const LinkStart one = random_start(), other = random_start();
  EXPECT_NE(one.session, other.session);
  EXPECT_NE(one.origin, other.origin);
  for (const LinkStart& start : {one, other, start_from(1, LinkEnd::kOperator)}) {
    EXPECT_NE(start.session, 0U);
    EXPECT_GE(start.origin, 0s);
    EXPECT_LT(start.origin, 5 * 366 * 24h);
  }
  EXPECT_EQ(start_from(7, LinkEnd::kOperator).session, start_from(7, LinkEnd::kOperator).session);
  EXPECT_NE(start_from(7, LinkEnd::kOperator).session, start_from(7, LinkEnd::kMachine).session);
  EXPECT_NE(start_from(7, LinkEnd::kOperator).session, start_from(8, LinkEnd::kOperator).session);
}

TEST(LinkSession, NewestNumberWinsAcrossTheWrap) {
  EXPECT_TRUE(newer(1, 0));
  EXPECT_FALSE(newer(0, 1));
  EXPECT_FALSE(newer(7, 7));
  EXPECT_TRUE(newer(0, 0xFFFFFFFF));
  EXPECT_FALSE(newer(0xFFFFFFFF, 0));
  EXPECT_TRUE(newer(0x7FFFFFFF, 0));
  EXPECT_FALSE(newer(0x80000001, 0));
}

TEST(LinkSession, LateCopyIsNoNewsHoweverLongTheSilence) {
  Conversation c;
  ASSERT_EQ(c.take(1000), Verdict::kBegins);
  for (std::uint32_t n = 1; n <= 1000; ++n) EXPECT_EQ(c.take_at(Time(1000s), n), Verdict::kOld) << n;
}

TEST(LinkSession, NothingOfASideThatHasNotHeardThisOneIsNews) {
  for (const std::uint64_t heard : {std::uint64_t{0}, kHere.session + 1, kThere.session}) {
    Conversation c;
    LinkStamp stamp = c.message(1);
    stamp.echoed_session = heard;
    EXPECT_EQ(c.here.take(stamp, c.arrival(1)), Verdict::kForeign) << heard;
    EXPECT_EQ(stamp.echoed, kNever);
    ASSERT_EQ(c.take(2), Verdict::kBegins);
    stamp = c.message(3);
    stamp.echoed_session = heard;
    EXPECT_EQ(c.here.take(stamp, c.arrival(3)), Verdict::kForeign) << "nor in the middle of a session: " << heard;
    EXPECT_FALSE(c.here.of_far(stamp));
    EXPECT_EQ(c.take(4), Verdict::kNews);
  }
  Conversation c;
  EXPECT_EQ(c.take(1, 0), Verdict::kForeign) << "0 is no session";
  EXPECT_EQ(c.here.far(), 0U);
}

TEST(LinkSession, AnEchoThatIsOldOrOfTheFutureBeginsNothing) {
  for (const auto& [age, begins] : {std::pair<Duration, bool>{0ms, true},
                                    {5s, true},
                                    {5s + 1ms, false},
                                    {-20ms, true},  // came in while the step was under way
                                    {-21ms, false}}) {
    Conversation c;
    LinkStamp stamp = c.message(1);
    stamp.echoed = Time(100s) + kHere.origin - age;
    EXPECT_EQ(c.here.take(stamp, Time(100s)), begins ? Verdict::kBegins : Verdict::kForeign) << to_seconds(age);
  }
}

TEST(LinkSession, AnotherSessionBeginsOnlyAfterSilenceAndWithANewerEcho) {
  Conversation c;
  ASSERT_EQ(c.take(1000), Verdict::kBegins);
  ASSERT_EQ(c.take(1001), Verdict::kNews);
  const Time last = c.arrival(1001);
  LinkStamp fresh = c.message(1, 6);
  const auto other = [&](Time arrived, Duration echo_after) {
    LinkStamp stamp = fresh;
    stamp.echoed = c.message(1001).echoed + echo_after;
    return c.here.take(stamp, arrived);
  };
  EXPECT_EQ(other(last + 199ms, 180ms), Verdict::kForeign) << "the one before is still there";
  for (Duration echo = 0ms; echo <= kMostHeld; echo += 1ms)
    EXPECT_EQ(other(last + 300ms, echo), Verdict::kForeign) << "one that was kept back may say that";
  EXPECT_EQ(other(last + 200ms, kMostHeld + 1ms), Verdict::kBegins);
  EXPECT_EQ(c.here.far(), 6U);
  EXPECT_EQ(c.take(1002), Verdict::kForeign) << "stragglers of the one before";
  EXPECT_EQ(c.take_at(last + 10s, 1010), Verdict::kForeign);
}

TEST(LinkSession, ASideThatRestartedFollowsNoRecordingOfItsEarlierRun) {
  Conversation before;
  std::vector<LinkStamp> recording;
  for (std::uint32_t n = 1; n < 500; ++n) {
    recording.push_back(before.message(n));
    EXPECT_NE(before.take(n), Verdict::kForeign);
  }
  LinkSession again({12, 4h}, kSilence);  // its clock may well begin where the last one began
  std::uint32_t n = 0;
  for (LinkStamp stamp : recording) EXPECT_EQ(again.take(stamp, before.arrival(++n) + 150ms), Verdict::kForeign);
  EXPECT_EQ(again.far(), 0U);
}

TEST(LinkSession, WhoMayBeginNextLearnsThatItIsHeard) {
  Conversation c;
  ASSERT_EQ(c.take(1), Verdict::kBegins);
  const Time last = c.arrival(1);
  LinkStamp stranger{6, 0, 1, Time(7h), {}};
  EXPECT_EQ(c.here.take(stranger, last + 100ms), Verdict::kForeign);
  EXPECT_EQ(c.here.stamp(1, last + 199ms).echoed_session, kThere.session);
  const LinkStamp stamp = c.here.stamp(2, last + 200ms);
  EXPECT_EQ(stamp.echoed_session, 6U);
  EXPECT_EQ(stamp.echoed, Time(7h) + kMostHeld) << "not heard for 100 ms";
}

TEST(LinkSession, EchoOfASilentFarSideGrowsOld) {
  Conversation c;
  ASSERT_EQ(c.take(1), Verdict::kBegins);
  const Time sent = c.message(1).sent_at;
  EXPECT_EQ(c.here.stamp(1, c.arrival(1) + 3ms).echoed, sent + 3ms);
  EXPECT_EQ(c.here.stamp(2, c.arrival(1) + 3s).echoed, sent + kMostHeld);
}

// -------------------------------------------------------------------------------------------------------------- late

TEST(LinkSession, LateIsWhatAMessageTookLongerThanTheQuickestOfLate) {
  Conversation c;
  for (std::uint32_t n = 1; n < 100; ++n) {
    const Duration more = n % 7 == 3 ? 2ms * (n % 5) : 0ms;
    ASSERT_NE(c.take_at(c.arrival(n) + more, n), Verdict::kForeign);
    EXPECT_EQ(c.here.late(), more) << n;
  }
}

TEST(LinkSession, ConstantDelayIsForgottenAfterTwoIntervals) {
  Conversation c;
  for (std::uint32_t n = 1; n < 200; ++n) ASSERT_NE(c.take(n), Verdict::kForeign);
  for (std::uint32_t n = 200; n < 800; ++n) {
    ASSERT_EQ(c.take_at(c.arrival(n) + 150ms, n), Verdict::kNews);
    const Duration since = (n - 200) * 2ms;
    if (since < AboveLeast::kInterval - 150ms) {
      EXPECT_EQ(c.here.late(), 150ms) << n;
    }
    if (since >= 2 * AboveLeast::kInterval) {
      EXPECT_EQ(c.here.late(), 0ms) << n;
    }
  }
}

TEST(LinkSession, AStepOfTheFarClockMakesNothingLate) {
  for (const Duration step : {Duration(10s), Duration(-10s), Duration(250ms), Duration(-250ms)}) {
    Conversation c;
    for (std::uint32_t n = 1; n <= 1000; ++n) {
      LinkStamp stamp = c.message(n);
      if (n >= 300) stamp.sent_at += step;
      const Duration more = n == 1000 ? 100ms : 0ms;
      ASSERT_NE(c.here.take(stamp, c.arrival(n) + more), Verdict::kForeign);
      ASSERT_EQ(c.here.late(), more) << n << " " << to_seconds(step);
    }
  }
}

TEST(LinkSession, ClocksThatDriftDoNotHideADelayNorMakeOne) {
  for (const double ppm : {200.0, -200.0}) {
    Conversation c;
    for (std::uint32_t n = 1; n < 50'000; ++n) {  // 100 s
      LinkStamp stamp = c.message(n);
      stamp.sent_at += Duration(static_cast<std::int64_t>(2000 * ppm * n * 1e-3));
      const bool held_back = n % 1000 == 999;
      ASSERT_NE(c.here.take(stamp, c.arrival(n) + (held_back ? 100ms : 0ms)), Verdict::kForeign);
      EXPECT_NEAR(to_seconds(c.here.late()), held_back ? 0.1 : 0, 1e-3) << n;
    }
  }
}

TEST(LinkSession, ADelayOnTheWayToTheFarSideMakesNothingLate) {
  Conversation c;
  for (std::uint32_t n = 1; n < 500; ++n) {
    LinkStamp stamp = c.message(n);
    if (n >= 200) stamp.echoed -= 100ms;
    ASSERT_NE(c.here.take(stamp, c.arrival(n)), Verdict::kForeign);
    EXPECT_EQ(c.here.late(), 0ms) << n;
  }
}

// Whatever the network does with the order, each message at most once, none before a newer one: also over silences.
TEST(LinkSession, RandomDeliveryNeverGoesBack) {
  std::mt19937 rng(5);
  const auto draw = [&rng](int most) { return std::uniform_int_distribution<>(0, most)(rng); };
  for (int run = 0; run < 200; ++run) {
    Conversation c;
    std::uint32_t newest = 0;
    for (int i = 1; i < 500; ++i) {
      const auto n = static_cast<std::uint32_t>(std::max(1, i - draw(300)));
      const Verdict verdict = c.take_at(c.arrival(static_cast<std::uint32_t>(i)) + draw(3) * 100ms, n);
      const bool taken = verdict == Verdict::kNews || verdict == Verdict::kBegins;
      EXPECT_EQ(taken, n > newest) << n;
      EXPECT_GE(c.here.late(), 0ms);
      if (taken) newest = n;
    }
    EXPECT_GT(newest, 400U);
  }
}

}  // namespace
}  // namespace knuckle
