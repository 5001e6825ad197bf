// Force and pressures over time on a console that runs, with one cursor for plots and events; the gauge; minutes of the
// link.
#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

constexpr Box kForcePlot{126, 268, 1010, 320};  // inside the topmost plot of History, 1280x800

/// Half a minute, in which the machine has pressed for two seconds; then this view.
void pass_half_a_minute(ConsoleView& view, const std::function<void()>& watch) {
  const Time end = view.now;
  for (view.now -= 30s; view.now < end; view.now += 50ms) {
    const double ago_s = to_seconds(end - view.now);
    view.machine.tip_force_N = {ago_s < 22 && ago_s > 20 ? -2000 : -100.0, 0};
    watch();
  }
}

class LiveHistory : public testing::Test {
 protected:
  LiveHistory() {
    pass_half_a_minute(view_, [this] { watch(); });
  }
  void watch() {
    plots_.watch(view_, true, true);
    plots_.update(view_);
  }
  void choose(Time at) {
    plots_.choose(at);
    plots_.update(view_);
  }
  [[nodiscard]] const History& shown() { return plots_.window().history(); }

  ConsoleView view_ = canned_view();
  screens::LivePlots plots_;
};

TEST_F(LiveHistory, ShowsTheForceOfTheChosenTimeThoughItIsNoLongerAmongTheLastTenSeconds) {
  const auto most = [this] {
    double force_N = 0;
    for (std::size_t i = 0; i < shown().size(); ++i)
      force_N = std::fmax(force_N, known_force_N(shown().ago(i).machine));
    return force_N;
  };
  EXPECT_DOUBLE_EQ(most(), 100);
  choose(view_.now - 21s);
  EXPECT_DOUBLE_EQ(most(), 2000);
  EXPECT_DOUBLE_EQ(shown().ago(100).machine.pressure_Pa[1], 22e5);
}

TEST_F(LiveHistory, StaysAtATimeThatIsOlderThanWhatIsKeptAndBeginsAnewWithTheSession) {
  const Time chosen = view_.now - 12s;
  choose(chosen);
  EXPECT_EQ(plots_.window().cursor().text, "12 s ago - End: now");
  view_.now += 11min;
  watch();
  EXPECT_EQ(plots_.chosen(), chosen);
  EXPECT_EQ(plots_.window().cursor().text, "11 min 12 s ago - End: now");
  view_.now = Time(1s);
  ++view_.run;
  watch();
  EXPECT_FALSE(plots_.chosen());
}

TEST_F(LiveHistory, HasNoGapAtTheRightWhereTheSecondsBehindAChosenTimeHaveCome) {
  choose(view_.now - 2s);
  for (int i = 0; i < 30; ++i) {
    view_.now += 170ms;
    watch();
  }
  for (std::size_t ago = 0; ago < shown().size(); ++ago)
    EXPECT_FALSE(std::isnan(known_force_N(shown().ago(ago).machine))) << ago;
}

TEST_F(LiveHistory, HasAGapWhereTheForceIsNotKnown) {
  view_.machine.confidence = 0;
  view_.now += 1s;
  watch();
  EXPECT_TRUE(std::isnan(known_force_N(shown().ago(0).machine)));
  EXPECT_FALSE(std::isnan(shown().ago(0).machine.pressure_Pa[0]));
}

class HistoryOnTheScreen : public ShownConsole {};

TEST_F(HistoryOnTheScreen, GoesWhereAnEventOrAPlotIsClickedAndByTheKeysOfThePlayerAndBackToNow) {
  pass_half_a_minute(view_, [this] { console_->watch(view_); });
  frames();
  const auto& rows = events_.rows();
  const auto chosen = [this] { return console_->live_plots().chosen(); };
  EXPECT_FALSE(chosen());
  does("key F6");
  click(600, 209);  // the newest event, on top
  EXPECT_EQ(chosen(), rows.back().at);
  does("key F7");
  const Pixels at_event = pixels();
  click(kForcePlot.left + (kForcePlot.right - kForcePlot.left) / 4, 300);
  ASSERT_TRUE(chosen());
  EXPECT_NEAR(to_seconds(*chosen()), to_seconds(rows.back().at) - 2.5, 0.2);
  console_->live_plots().choose(view_.now - 21s);
  frames();
  EXPECT_GT(count_changed(at_event, pixels(), kForcePlot), 500);
  for (const char* screen : {"F3", "F4", "F7"}) {
    does(std::string("key ") + screen);
    EXPECT_TRUE(std::ranges::any_of(drawn_with("21 s ago"),
                                    [](const DrawnText& text) { return text.min.x > 114 && text.min.y > 180; }))
        << screen << ": its plots are of another time";  // below the card that has the time in words
  }
  does("key End");
  EXPECT_FALSE(chosen());
  does("key bracketleft");
  does("key bracketleft");
  EXPECT_EQ(chosen(), rows[rows.size() - 2].at);
  does("key bracketright");
  EXPECT_EQ(chosen(), rows.back().at);
  does("key bracketright");
  EXPECT_FALSE(chosen()) << "behind the newest comes now";
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

TEST_F(MinutesOnTheScreen, ShowADelayThatTheMedianHidesPaleAndABadMinuteLongAfterTheTenSeconds) {
  does("key F2");
  const Box kRoundTrip{574, 320, 1012, 452};
  const ImU32 bad = theme().colours.bad;
  const Pixels before = pixels();
  view_.link.round_trip_s = 0.9;  // of the newest packet alone
  frames();
  view_.link.round_trip_s = 0.024;
  view_.now += 30s;
  const Pixels pale = pixels();
  EXPECT_GT(count_changed(before, pale, kRoundTrip), 20);
  EXPECT_EQ(count_near(pale, kRoundTrip, bad), 0) << "the word goes by the median";
  const auto pass = [this](Duration time) {
    for (const Time end = view_.now + time; view_.now < end; view_.now += 100ms) console_->watch(view_);
  };
  pass(60s);
  const ConsoleView good = view_;
  view_.link.round_trip_s = 0.9;
  view_.link.round_trip = {};
  view_.link.round_trip.add(900ms);
  pass(5s);
  view_.link = good.link;
  pass(240s);
  EXPECT_GT(count_near(pixels(), kRoundTrip, bad), 3);
}

}  // namespace
}  // namespace knuckle::console::window
