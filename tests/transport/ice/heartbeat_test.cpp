#include <gtest/gtest.h>

#include "transport/ice/path.h"
#include "transport/secure/dtls_session.h"

namespace knuckle::ice {
namespace {

using namespace std::chrono_literals;

class IceHeartbeat : public testing::Test {
 protected:
  const Heartbeat::Clock::time_point now_ = Heartbeat::Clock::now();
  Heartbeat here_, there_;
};

TEST_F(IceHeartbeat, MeasuresTheRoundTripOfItsOwnQuestions) {
  const auto question = here_.question(now_, false);
  ASSERT_TRUE(question);
  const auto answer = there_.hear(*question, now_ + 3ms);
  ASSERT_TRUE(answer);
  EXPECT_FALSE(here_.hear(*answer, now_ + 7ms));  // nothing to answer
  EXPECT_EQ(here_.answered_at(), now_ + 7ms);
  EXPECT_EQ(here_.take_round_trip(), 7ms);
  EXPECT_FALSE(here_.take_round_trip());
}

TEST_F(IceHeartbeat, TakesNoAnswerThatWasGuessedRepeatedOrMadeOfAQuestion) {
  const auto question = here_.question(now_, false);
  Beat guessed = *question;
  guessed[1] = 2;
  guessed[5] ^= 1;
  (void)here_.hear(guessed, now_ + 1ms);
  EXPECT_FALSE(here_.answered_at());
  const auto answer = there_.hear(*question, now_ + 1ms);
  (void)here_.hear(*answer, now_ + 2ms);
  (void)here_.hear(*answer, now_ + 500ms);
  EXPECT_EQ(here_.answered_at(), now_ + 2ms);
}

TEST_F(IceHeartbeat, AsksTenTimesASecondAndAtOnceWhenHurried) {
  ASSERT_TRUE(here_.question(now_, false));
  EXPECT_FALSE(here_.question(now_ + 99ms, false));
  EXPECT_TRUE(here_.question(now_ + 100ms, false));
  here_.hurry();
  EXPECT_TRUE(here_.question(now_ + 101ms, false));
}

TEST_F(IceHeartbeat, SaysOnceAndForAllThatTheFarEndUsesThePath) {
  (void)there_.hear(*here_.question(now_, false), now_);
  EXPECT_FALSE(there_.far_end_uses());
  (void)there_.hear(*here_.question(now_ + 1s, true), now_ + 1s);
  EXPECT_TRUE(there_.far_end_uses());
}

TEST_F(IceHeartbeat, TakesNoDatagramOfTheLinkForItsOwn) {
  std::array<std::uint8_t, secure::kSealOverhead> sealed{kBeatMark};  // an observer's tag may begin like this
  static_assert(kBeatMark >= secure::kObserverTagMark && kBeatMark < secure::kTagMark);
  EXPECT_FALSE(Heartbeat::is_beat(sealed));
  EXPECT_FALSE(Heartbeat::is_beat({}));
  EXPECT_TRUE(Heartbeat::is_beat(*here_.question(now_, false)));
}

TEST_F(IceHeartbeat, AnswersNothingOfAnotherSizeOrKind) {
  const auto question = here_.question(now_, false);
  EXPECT_FALSE(there_.hear(std::span(*question).first(kBeatSize - 1), now_));
  Beat other = *question;
  other[1] = 9;
  EXPECT_FALSE(there_.hear(other, now_));
  EXPECT_FALSE(there_.heard_at());
}

}  // namespace
}  // namespace knuckle::ice
