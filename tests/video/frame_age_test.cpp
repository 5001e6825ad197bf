// How old a picture is, by its stamps.
#include <gtest/gtest.h>

#include "video/frame.h"

namespace knuckle::video {
namespace {

Frame frame(Duration captured, Duration received, StampFrom from = StampFrom::kHere) {
  Frame f;
  f.connection = 1;
  f.stamp_from = from;
  f.captured = Time(captured);
  f.received = Time(received);
  return f;
}

TEST(FrameAge, CountsFromTheStampNotFromArrival) {
  FrameAge age;
  age.take(frame(10s, 10s + 400ms));
  EXPECT_DOUBLE_EQ(age.age_s(Time(10s + 410ms)), 0.41);
  EXPECT_EQ(age.state(Time(10s + 410ms)), VideoState::kLate);
}

TEST(FrameAge, IsFrozenWithoutANewFrameForLessThanThreeTenthsAndLiveAgainWithTheNext) {
  FrameAge age;
  EXPECT_EQ(age.state(Time(9s)), VideoState::kNone);
  age.take(frame(10s, 10s));
  EXPECT_EQ(age.state(Time(10s + 250ms)), VideoState::kLive);
  EXPECT_EQ(age.state(Time(10s + 283ms)), VideoState::kFrozen);
  age.take(frame(12s, 12s));
  EXPECT_EQ(age.state(Time(12s)), VideoState::kLive);
}

TEST(FrameAge, NeedsNoCommonClockWithTheSender) {
  FrameAge age;
  for (int i = 0; i < 30; ++i) age.take(frame(5000h + i * 33ms, 10s + i * 33ms, StampFrom::kSender));
  EXPECT_NEAR(age.age_s(Time(10s + 29 * 33ms + 20ms)), 0.02, 1e-6);
}

TEST(FrameAge, SeesAPictureThatIsSentAgainAsOld) {
  FrameAge age;
  for (int i = 0; i < 30; ++i) age.take(frame(1h, 10s + i * 33ms, StampFrom::kSender));
  EXPECT_EQ(age.state(Time(10s + 29 * 33ms)), VideoState::kLate);
}

TEST(FrameAge, NeverForgetsThatAStreamIsLate) {
  FrameAge age;
  Duration t = 0s;
  for (; t < 10s; t += 33ms) age.take(frame(1h + t, t + 50ms, StampFrom::kSender));
  for (; t < 3h; t += 1s) age.take(frame(1h + t, t + 350ms, StampFrom::kSender));
  EXPECT_EQ(age.state(Time(t - 1s + 350ms)), VideoState::kLate);
}

TEST(FrameAge, IsFrozenWhereNothingComesHoweverLateTheLastPictureWasSaidToBeDue) {
  FrameAge age;
  age.take(frame(12s, 10s));
  EXPECT_EQ(age.state(Time(10s + 200ms)), VideoState::kLive);
  EXPECT_NEAR(age.age_s(Time(10s + 200ms)), 0.2, 1e-9);
  EXPECT_EQ(age.state(Time(10s + 283ms)), VideoState::kFrozen);
}

TEST(FrameAge, DoesNotMixStampsOfTwoClocks) {
  FrameAge age;
  age.take(frame(10s, 10s));
  age.take(frame(1s, 10s + 33ms, StampFrom::kSender));  // its clock counts from its own start
  EXPECT_EQ(age.state(Time(10s + 50ms)), VideoState::kLive);
}

TEST(FrameAge, FollowsClocksThatDriftApart) {
  FrameAge age;
  constexpr double kSlow = 1 - 80e-6;  // the sender's clock
  Duration t = 0s;
  for (; t < 3h; t += 1s) age.take(frame(from_seconds(kSlow * to_seconds(t)), t + 50ms, StampFrom::kSender));
  EXPECT_EQ(age.state(Time(t - 1s + 60ms)), VideoState::kLive);
}

TEST(FrameAge, BeginsAnewWithAConnection) {
  FrameAge age;
  age.take(frame(1h, 1s, StampFrom::kSender));
  Frame later = frame(1h + 1s, 12s, StampFrom::kSender);  // the sender's clock was put back
  later.connection = 2;
  age.take(later);
  EXPECT_EQ(age.state(Time(12s)), VideoState::kLive);
}

}  // namespace
}  // namespace knuckle::video
