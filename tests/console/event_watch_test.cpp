// What the loops tell the event book of a force that is more than the person wants.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "app/console/event_book.h"
#include "tests/console/console_rig.h"

namespace knuckle::console {
namespace {

class MaximumForce : public testing::Test {
 protected:
  /// One step with this force on the tip.
  void press(double force_N) {
    machine_.tip_force_N = {-0.8 * force_N, 0.6 * force_N};
    Watched side;
    side.machine = &machine_;
    side.force_most_N = most_N_;
    watch_.step(now_ += 5ms, side, nullptr);
    for (ConsoleEvent event; ring_->pop(event);)
      if (event.kind == ConsoleEventKind::kTooMuch) told_.push_back(event);
  }
  MaximumForce() { machine_.confidence = 0.8; }

  std::unique_ptr<EventRing> ring_ = std::make_unique<EventRing>();
  EventWatch watch_{*ring_};
  SlaveMessage machine_;
  double most_N_ = 5000;
  Time now_{};
  std::vector<ConsoleEvent> told_;
};

/// What the banner calls a lost link and sounds an alarm for is in the list of events, too.
TEST(EventWatch, TellsOfALinkThatIsLostForAsLongAsTheBannerSaysIt) {
  const auto ring = std::make_unique<EventRing>();
  EventWatch watch(*ring);
  const SlaveMessage machine;
  Watched side;
  side.machine = &machine;
  std::vector<bool> told;
  Time now{};
  for (const double silence_s : {0.0, 0.2, 0.3, 0.6, 0.0}) {
    side.silence_s = silence_s;
    watch.step(now += 5ms, side, nullptr);
    for (ConsoleEvent event; ring->pop(event);)
      if (event.kind == ConsoleEventKind::kLink) told.push_back(event.on);
  }
  EXPECT_EQ(told, (std::vector<bool>{true, false, true}));
}

TEST_F(MaximumForce, IsToldWithForceAndMaximumWhenItIsExceeded) {
  press(4990);
  EXPECT_TRUE(told_.empty());
  press(5200);
  ASSERT_EQ(told_.size(), 1u);
  EventBook book;
  book.add(told_[0], {});
  const EventRow& row = book.rows().front();
  EXPECT_EQ(row.severity, Severity::kWarning);
  EXPECT_EQ(row.text, "force on the tip is too much: 5200 N; maximum set 5000 N");
}

TEST_F(MaximumForce, IsToldOnceOfAForceThatHoversAboutIt) {
  for (int i = 0; i < 200; ++i) press(5000 + 400 * std::sin(0.3 * i));
  EXPECT_EQ(told_.size(), 1u);
  press(4499);
  ASSERT_EQ(told_.size(), 2u);
  EXPECT_FALSE(told_[1].on);
  for (int i = 0; i < 200; ++i) press(4500 + 400 * std::sin(0.3 * i));
  EXPECT_EQ(told_.size(), 2u);
  press(5001);
  EXPECT_EQ(told_.size(), 3u);
}

TEST_F(MaximumForce, IsNotExceededByAForceWithoutConfidence) {
  machine_.confidence = 0.05;
  press(9000);
  EXPECT_TRUE(told_.empty());
  machine_.confidence = 0.8;
  press(9000);
  machine_.confidence = 0.05;
  press(0);
  EXPECT_EQ(told_.size(), 1u) << "nor does it end by one";
}

TEST_F(MaximumForce, IsTheOneThatIsSetNow) {
  press(3000);
  most_N_ = 2000;
  press(3000);
  EXPECT_EQ(told_.size(), 1u);
  most_N_ = ConsoleInput{}.force_most_N;
  press(30000);
  EXPECT_EQ(told_.size(), 2u) << "over, for there is no maximum";
}

TEST(ConsoleMaximumForce, OfTheWindowIsWhatTheLoopTellsOf) {
  test::ConsoleRig rig(test::live_setup("wall_contact"), LiveSession::Led::kByScenario);
  rig.input.force_most_N = 300;
  for (int i = 0; i < 80 && !test::told(rig, ConsoleEventKind::kTooMuch, true); ++i) rig.run(0.5);
  EXPECT_TRUE(test::told(rig, ConsoleEventKind::kTooMuch, true));
}

}  // namespace
}  // namespace knuckle::console
