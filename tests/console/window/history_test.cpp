// Force and pressures over time on a console that runs, with one cursor for plots and events; the gauge; minutes of the
// link.
#include <algorithm>
#include <cmath>

#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

constexpr Box kForcePlot{126, 268, 1010, 320};  // inside the topmost plot of History, 1280x800

class LiveHistory : public ShownConsole {
 protected:
  void SetUp() override {
    ShownConsole::SetUp();
    if (IsSkipped()) return;
    // Half a minute, in which the machine has pressed for two seconds.
    const Time end = view_.now;
    for (view_.now -= 30s; view_.now < end; view_.now += 50ms) {
      const double ago_s = to_seconds(end - view_.now);
      view_.machine.tip_force_N = {ago_s < 22 && ago_s > 20 ? -2000 : -100.0, 0};
      console_->watch(view_);
    }
    frames();
  }
  [[nodiscard]] static Time at(double seconds) { return Time(from_seconds(seconds)); }
};

TEST_F(LiveHistory, GoesWhereAnEventOrAPlotIsClickedAndBackToNow) {
  EXPECT_FALSE(console_->live_plots().chosen());
  does("key F6");
  click(600, 209);  // the newest event, on top
  ASSERT_TRUE(console_->live_plots().chosen());
  EXPECT_EQ(*console_->live_plots().chosen(), events_.rows().back().at);
  does("key F7");
  click(kForcePlot.left + (kForcePlot.right - kForcePlot.left) / 4, 300);
  EXPECT_NEAR(to_seconds(*console_->live_plots().chosen()), to_seconds(events_.rows().back().at) - 2.5, 0.2);
  does("key End");
  EXPECT_FALSE(console_->live_plots().chosen());
}

TEST_F(LiveHistory, GoesFromEventToEventByTheKeysOfThePlayer) {
  const auto& rows = events_.rows();
  does("key bracketleft");
  EXPECT_EQ(console_->live_plots().chosen(), rows.back().at);
  does("key bracketleft");
  EXPECT_EQ(console_->live_plots().chosen(), rows[rows.size() - 2].at);
  does("key bracketright");
  EXPECT_EQ(console_->live_plots().chosen(), rows.back().at);
  does("key bracketright");
  EXPECT_FALSE(console_->live_plots().chosen()) << "behind the newest comes now";
}

TEST_F(LiveHistory, ShowsTheForceOfTheChosenTimeThoughItIsNoLongerAmongTheLastTenSeconds) {
  does("key F7");
  const auto most = [this] {
    const History& shown = console_->live_plots().window().history();
    double force_N = 0;
    for (std::size_t i = 0; i < shown.size(); ++i) force_N = std::fmax(force_N, known_force_N(shown.ago(i).machine));
    return force_N;
  };
  const Pixels now = pixels();
  EXPECT_DOUBLE_EQ(most(), 100);
  console_->live_plots().choose(view_.now - 21s);
  frames();
  EXPECT_DOUBLE_EQ(most(), 2000);
  EXPECT_GT(count_changed(now, pixels(), kForcePlot), 500);
  EXPECT_DOUBLE_EQ(console_->live_plots().window().history().ago(100).machine.pressure_Pa[1], 22e5);
}

TEST_F(LiveHistory, SaysOnEveryScreenThatItsPlotsAreOfAnotherTime) {
  for (const char* screen : {"F3", "F4", "F7"}) {
    does("key End");
    does(std::string("key ") + screen);
    console_->live_plots().choose(view_.now - 12s);
    frames();
    EXPECT_EQ(console_->live_plots().window().cursor().text, "12 s ago - End: now");
    EXPECT_TRUE(std::ranges::any_of(drawn_with("12 s ago"), [](const DrawnText& text) {
      return text.min.x > 114 && text.min.y > 180;
    })) << screen;  // below the card that has the time in words
  }
  EXPECT_EQ(screens::ago_text(192s), "3 min 12 s ago");
}

TEST_F(LiveHistory, StaysAtATimeThatIsOlderThanWhatIsKept) {
  const Time event = events_.rows().back().at;
  console_->live_plots().choose(event);
  frames();
  view_.now += 11min;
  frames();
  EXPECT_EQ(console_->live_plots().chosen(), event);
  EXPECT_EQ(console_->live_plots().window().cursor().text.rfind("11 min", 0), 0U);
}

TEST_F(LiveHistory, HasNoGapAtTheRightWhereTheSecondsBehindAChosenTimeHaveCome) {
  console_->live_plots().choose(view_.now - 2s);
  frames();
  for (int i = 0; i < 30; ++i) {
    view_.now += 170ms;
    console_->frame(view_, loop_, events_, 0);
    console_->show();
  }
  const History& shown = console_->live_plots().window().history();
  for (std::size_t ago = 0; ago < shown.size(); ++ago)
    EXPECT_FALSE(std::isnan(known_force_N(shown.ago(ago).machine))) << ago;
}

TEST_F(LiveHistory, HasAGapWhereTheForceIsNotKnown) {
  view_.machine.confidence = 0;
  view_.now += 1s;
  console_->watch(view_);
  frames();
  const SlaveMessage& newest = console_->live_plots().window().history().ago(0).machine;
  EXPECT_TRUE(std::isnan(known_force_N(newest)));
  EXPECT_FALSE(std::isnan(newest.pressure_Pa[0]));
}

TEST_F(LiveHistory, BeginsAnewWithTheSession) {
  console_->live_plots().choose(view_.now - 3s);
  frames();
  view_.now = Time(1s);
  view_.simulated_s = 1;
  ++view_.run;
  frames();
  EXPECT_FALSE(console_->live_plots().chosen());
}

class ForceGauge : public ShownConsole {
 protected:
  static constexpr Box kGauge{736, 208, 1012, 236};
};

TEST_F(ForceGauge, FillsToTheMaximumThatThePersonSetsAndSaysWhenItIsTooMuch) {
  const ImU32 accent = theme().colours.accent, bad = theme().colours.bad;
  state().force_most_N = 4000;
  const int some = count_near(pixels(), kGauge, accent);
  state().force_most_N = 2000;
  const int more = count_near(pixels(), kGauge, accent);
  EXPECT_GT(some, 200);
  EXPECT_GT(more, 1.7 * some);
  EXPECT_LT(count_near(pixels(), kGauge, bad), 50);
  state().force_most_N = 1000;
  EXPECT_GT(count_near(pixels(), kGauge, bad), 2000);
  EXPECT_EQ(console_->input(view_.now).force_most_N, 1000) << "the loop tells of it";
  view_.machine.confidence = 0;
  view_.machine.pressure_Pa.fill(std::nan(""));  // nor is it known what presses
  EXPECT_LT(count_near(pixels(), kGauge, bad), 50) << "a force without confidence is no force";
}

class MinutesOnTheScreen : public ShownConsole {};

TEST_F(MinutesOnTheScreen, ShowABadMinuteOfTheLinkLongAfterTheTenSeconds) {
  does("key F2");
  const auto pass = [this](Duration time) {
    for (const Time end = view_.now + time; view_.now < end; view_.now += 100ms) console_->watch(view_);
  };
  pass(60s);
  const ConsoleView good = view_;
  const Pixels before = pixels();
  view_.link.round_trip_s = 0.9;
  view_.link.round_trip = {};
  view_.link.round_trip.add(900ms);
  pass(5s);
  view_.link = good.link;
  pass(240s);
  const Box kRoundTrip{574, 320, 1012, 452};
  const Pixels after = pixels();
  const ImU32 bad = theme().colours.bad;
  EXPECT_EQ(count_near(before, kRoundTrip, bad), 0);
  EXPECT_GT(count_near(after, kRoundTrip, bad), 3);
}

TEST_F(MinutesOnTheScreen, ShowADelayThatTheMedianHidesPaleBehindIt) {
  does("key F2");
  const Box kRoundTrip{574, 320, 1012, 452};
  const Pixels before = pixels();
  view_.link.round_trip_s = 0.9;  // of the newest packet alone
  frames();
  view_.link.round_trip_s = 0.024;
  view_.now += 30s;
  const Pixels after = pixels();
  EXPECT_GT(count_changed(before, after, kRoundTrip), 20);
  EXPECT_EQ(count_near(after, kRoundTrip, theme().colours.bad), 0) << "the word goes by the median";
}

}  // namespace
}  // namespace knuckle::console::window
