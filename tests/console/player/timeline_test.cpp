// How the player's cursor moves.
#include <gtest/gtest.h>

#include "app/console/player/run.h"
#include "tests/console/player/played_files.h"

namespace knuckle::test {
namespace {

namespace player = console::player;

class Timeline : public testing::Test {
 protected:
  player::Played played_ = player::load({recorded("lost_link")});
  player::Timeline timeline_{played_.run, played_.events};
  Time first_ = played_.run.first(), last_ = played_.run.last();
};

TEST_F(Timeline, BeginsPausedPlaysAtItsSpeedAndStopsAtTheEnd) {
  timeline_.pass(1);
  EXPECT_EQ(timeline_.cursor(), first_);
  EXPECT_FALSE(timeline_.playing());
  timeline_.toggle();
  timeline_.pass(0.5);
  EXPECT_EQ(timeline_.cursor(), first_ + 500ms);
  for (int i = 0; i < 9; ++i) timeline_.slower();
  EXPECT_EQ(timeline_.speed(), 0.1);
  timeline_.pass(1);
  EXPECT_EQ(timeline_.cursor(), first_ + 600ms);
  for (int i = 0; i < 9; ++i) timeline_.faster();
  EXPECT_EQ(timeline_.speed(), 10);
  EXPECT_TRUE(timeline_.playing());
  timeline_.pass(1);
  EXPECT_EQ(timeline_.cursor(), last_);
  EXPECT_FALSE(timeline_.playing());
  timeline_.toggle();
  EXPECT_EQ(timeline_.cursor(), first_) << "from the end it begins anew";
  EXPECT_TRUE(timeline_.playing());
}

TEST_F(Timeline, StepsFromOneCycleOfALoopToTheNextAndIsStoppedByIt) {
  timeline_.toggle();
  timeline_.seek(Time(1s) + 300us);
  EXPECT_FALSE(timeline_.playing());
  timeline_.toggle();
  timeline_.step(true);
  EXPECT_FALSE(timeline_.playing());
  EXPECT_EQ(timeline_.cursor(), Time(1001ms));
  timeline_.step(true);
  EXPECT_EQ(timeline_.cursor(), Time(1002ms));
  timeline_.step(false);
  timeline_.step(false);
  EXPECT_EQ(timeline_.cursor(), Time(1s));
  timeline_.seek(last_);
  timeline_.step(true);
  EXPECT_EQ(timeline_.cursor(), last_);
  timeline_.seek(first_);
  timeline_.step(false);
  EXPECT_EQ(timeline_.cursor(), first_);
}

TEST_F(Timeline, OfTheMachinesSideAloneStepsInThatLoopsCycles) {
  const player::Played load = player::load({recorded("load")});
  player::Timeline timeline(load.run, load.events);
  timeline.seek(Time(1s));
  timeline.step(true);
  EXPECT_EQ(timeline.cursor(), Time(1005ms));
}

TEST_F(Timeline, NeverLeavesTheRecording) {
  timeline_.move(-100s);
  EXPECT_EQ(timeline_.cursor(), first_);
  timeline_.seek(Time(1h));
  EXPECT_EQ(timeline_.cursor(), last_);
  EXPECT_EQ(timeline_.at_share(-3), first_);
  EXPECT_EQ(timeline_.at_share(2), last_);
  EXPECT_DOUBLE_EQ(timeline_.share(last_), 1);
}

TEST_F(Timeline, JumpsFromEventToEventAndPauses) {
  std::vector<Time> times;
  for (const console::EventRow& row : played_.events)
    if (times.empty() || times.back() != row.at) times.push_back(row.at);
  ASSERT_GT(times.size(), 4u);
  timeline_.toggle();
  for (const Time at : times) {
    timeline_.jump(true);
    EXPECT_EQ(timeline_.cursor(), at);
    EXPECT_FALSE(timeline_.playing());
  }
  timeline_.jump(true);
  EXPECT_EQ(timeline_.cursor(), times.back()) << "there is none after it";
  for (auto at = std::next(times.rbegin()); at != times.rend(); ++at) {
    timeline_.jump(false);
    EXPECT_EQ(timeline_.cursor(), *at);
  }
}

}  // namespace
}  // namespace knuckle::test
