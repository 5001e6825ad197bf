// A recording in a real window, with real keys and a real mouse: what is shown is what was recorded of that time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "app/console/window/console_program.h"
#include "app/console/window/console_window.h"
#include "tests/console/player/played_files.h"
#include "tests/console/window/console_run.h"
#include "tests/console/window/drawn_texts.h"
#include "tests/console/window/keyboard_walk.h"
#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {
namespace {

constexpr const char* kNoDisplay = "console: SKIPPED, no Xvfb here (package xvfb)";

/// A recording as the window has it, without one.
class PlayedRecording : public testing::Test {
 protected:
  void load(const std::string& name) {
    options_.replay = {test::recorded(name)};
    player::Played played = player::load(options_.replay);
    std::optional<screens::Beside> beside = beside_of(options_, played);
    panel_ = std::make_unique<screens::PlayerPanel>(std::move(played), std::move(beside));
  }
  void seek(Time at) {
    panel_->timeline().seek(at);
    panel_->pass(0);
  }

  ConsoleOptions options_;
  std::unique_ptr<screens::PlayerPanel> panel_;
};

class Player : public PlayedRecording {
 protected:
  void SetUp() override {
    if (!display_.up()) GTEST_SKIP() << kNoDisplay;
    open("lost_link");
  }
  void open(const std::string& name) {
    window_.reset();
    load(name);
    screens::ConsoleFacts facts;
    facts.machine = panel_->played().machine;
    window_ = std::make_unique<ConsoleWindow>(WindowOptions{.full_speed = true}, facts);
    window_->play(*panel_);
    frames(3);
  }
  void frames(int count, double seconds = 0) {
    for (int i = 0; i < count; ++i) {
      panel_->pass(seconds);
      window_->frame_of_player();
      window_->show();
    }
  }
  /// @param words for xdotool.
  void does(const std::string& words) {
    ASSERT_TRUE(xdotool(words));
    frames(4);
  }
  [[nodiscard]] bool shows(const std::string& words) {
    const auto all = texts_of([this] { frames(2); });
    return std::any_of(all.begin(), all.end(), [&](const DrawnText& text) { return text.text == words; });
  }
  [[nodiscard]] Time cursor() const { return panel_->timeline().cursor(); }

  VirtualDisplay display_{"1280x800"};
  std::unique_ptr<ConsoleWindow> window_;
};

// Of the window of 1280x800; where the time line begins and ends, and the middle of its height.
constexpr int kLineLeft = 464, kLineRight = 1260, kLineY = 770;

TEST_F(Player, IsLedByItsKeysOnEveryScreen) {
  const Time first = cursor();
  const std::array<std::pair<const char*, Time>, 8> keys{{{"period", first + 1ms},
                                                          {"comma", first},
                                                          {"l", first + 1s},
                                                          {"j", first},
                                                          {"bracketright", panel_->played().events.front().at},
                                                          {"End", panel_->played().run.last()},
                                                          {"bracketleft", panel_->played().events.back().at},
                                                          {"Home", first}}};
  for (const auto& [key, to] : keys) {
    does(std::string("key ") + key);
    EXPECT_EQ(cursor(), to) << key;
  }
  for (const char* screen_key : {"F2", "F3", "F4", "F5", "F6", "F1"}) {
    const Time before = cursor();
    does(std::string("key ") + screen_key + " period");
    EXPECT_EQ(cursor(), before + 1ms) << screen_key;
  }
  does("key F6");
  EXPECT_EQ(window_->state().screen, Screen::kEvents);
  const Time before = cursor();
  does("key space");
  EXPECT_TRUE(panel_->timeline().playing());
  frames(2, 0.25);
  EXPECT_EQ(cursor(), before + 500ms);
  does("key equal");
  EXPECT_EQ(panel_->timeline().speed(), 2);
  does("key minus key minus");
  EXPECT_EQ(panel_->timeline().speed(), 0.5);
  does("key space");
  EXPECT_FALSE(panel_->timeline().playing());
  EXPECT_FALSE(window_->state().stop);
}

TEST_F(Player, TakesNoKeyThatLeadsALiveMachine) {
  does("key b key p key ctrl+r keydown shift keydown q");
  const ConsoleInput input = window_->input(Time{});
  does("keyup q keyup shift");
  EXPECT_EQ(window_->state().bookmarks, 0u);
  EXPECT_EQ(window_->state().reset_count, 0u);
  EXPECT_FALSE(window_->state().paused);
  EXPECT_FALSE(input.hand.enable || input.hand.presence || input.stop);
}

/// The screens are those of a live machine, which the keyboard gets around (KeyboardFocus); the player's column and
/// time line are beside them.
TEST_F(Player, IsOperatedByTheKeyboardAlone) {
  const KeyboardWalk walk([this](int count) { frames(count); });
  for (const char* screen_key : {"F1", "F6"}) {
    does(std::string("key ") + screen_key);
    EXPECT_EQ(walk.missed(), "") << screen_key;
  }
  ASSERT_TRUE(walk.go_to("##event_on"));
  const Time before = cursor();
  walk.press("Return");
  EXPECT_GT(cursor(), before);
}

TEST_F(Player, ShowsContactsAndTheLinksMinutesUpToTheCursor) {
  open("press");
  EXPECT_FALSE(shows("to the last contact"));
  does("key End");
  EXPECT_TRUE(shows("to the last contact"));
  does("key F2");
  EXPECT_TRUE(shows("-10 min to the cursor"));
  EXPECT_FALSE(shows("-10 min to now"));
}

TEST_F(Player, IsScrubbedWithTheMouseAndGoesWhereAPlotOrAnEventIsClicked) {
  does("mousemove " + std::to_string(kLineLeft + 50) + " " + std::to_string(kLineY) + " mousedown 1");
  for (const int x : {600, 800, 1000, 1200}) {
    does("mousemove " + std::to_string(x) + " " + std::to_string(kLineY));
    const double share = double(x - kLineLeft) / (kLineRight - kLineLeft);
    EXPECT_NEAR(panel_->timeline().share(cursor()), share, 0.01) << x;
  }
  does("mouseup 1");
  const Time left_at = cursor();
  does("mousemove 600 400");
  EXPECT_EQ(cursor(), left_at) << "let go of";
  panel_->timeline().seek(Time(1s));
  does("key F4");
  does("mousemove 570 200 click 1");  // right of the middle of the boom's plot
  EXPECT_GT(cursor(), Time(1s) + 200ms);
  EXPECT_LT(cursor(), Time(2s));
  EXPECT_NEAR(panel_->plots().cursor().share, 0.5, 0.01) << "the plots follow";
  does("key F6");
  does("mousemove 600 209 click 1");  // the newest event, on top
  EXPECT_EQ(cursor(), panel_->played().events.back().at);
}

TEST_F(Player, ShowsTheSamePictureOfATimeHoweverItIsReached) {
  const test::TemporaryFolder folder;
  const auto picture = [&](const std::string& name) {
    window_->hold_steady();
    frames(3);
    panel_->pass(0);
    window_->frame_of_player();
    window_->write_png(folder.file(name));
    window_->show();
    return test::content(folder.file(name));
  };
  panel_->timeline().seek(Time(1500ms));
  const std::string sought = picture("sought.png");
  does("key Home");
  EXPECT_NE(picture("begin.png"), sought);
  does("key l");
  ASSERT_EQ(cursor(), Time(1001ms));
  panel_->timeline().toggle();
  frames(1, 0.499);
  panel_->timeline().toggle();
  ASSERT_EQ(cursor(), Time(1500ms));
  EXPECT_EQ(picture("played.png"), sought);
}

TEST_F(PlayedRecording, PlotsAroundTheCursorWhatWasRecordedThere) {
  load("lost_link");
  seek(Time(1s));
  const History& history = panel_->plots().history();
  ASSERT_EQ(history.size(), History::kSamples);
  EXPECT_TRUE(std::isnan(history.ago(0).status.valve_command[0])) << "five seconds later nothing was recorded";
  int known = 0;
  test::for_each_state<slave::SlaveState>(
      test::recorded("lost_link"), recording::Topic::kMachineState, [&](const slave::SlaveState& state) {
        // What the machine's side commanded reaches the operator's side a little later, in one of the next samples.
        const Time told = state.at + 20ms;
        if (told.time_since_epoch() % 50ms != Duration::zero() || told <= Time(100ms) || told > Time(2s)) return;
        const auto ago = static_cast<std::size_t>((Time(6s) - told) / 50ms);
        const player::MachineStep* step = panel_->played().run.machine_at(told);
        ASSERT_NE(step, nullptr);
        // What was old at the operator's side is a gap, there as here.
        const bool old = screens::machine_freshness(panel_->played().run.view(told)).stale();
        EXPECT_EQ(std::isnan(history.ago(ago).status.valve_command[0]), old) << to_seconds(told);
        if (old) return;
        EXPECT_EQ(history.ago(ago).status.valve_command[0], double{step->command[0]}) << to_seconds(told);
        ++known;
      });
  EXPECT_GT(known, 10);
}

TEST_F(PlayedRecording, ShowsAReRunBesideItAndSaysWhereItDiffers) {
  const test::TemporaryFolder folder;
  options_.changes.with = {test::slower_machine(folder, "press")};
  load("press");
  ASSERT_TRUE(panel_->beside());
  ASSERT_TRUE(panel_->beside()->differs_at);
  ASSERT_FALSE(panel_->beside()->differs.empty());
  const std::string& differs = panel_->beside()->differs.front();
  EXPECT_NE(differs.find("machine differs from 0."), std::string::npos) << differs;
  EXPECT_GT(*panel_->beside()->differs_at, Time(400ms)) << "the gain matters once the machine moves: " << differs;
  seek(*panel_->beside()->differs_at + 300ms);
  ASSERT_NE(panel_->beside_view(), nullptr);
  EXPECT_NE(panel_->beside_view()->status.valve_command, panel_->view().status.valve_command);
  ASSERT_NE(panel_->plots().cursor().beside, nullptr);
}

TEST_F(PlayedRecording, ShowsAnotherRecordingBesideIt) {
  options_.beside = {test::recorded("press")};
  load("lost_link");
  ASSERT_TRUE(panel_->beside());
  ASSERT_TRUE(panel_->beside()->differs_at);
  EXPECT_NEAR(to_seconds(*panel_->beside()->differs_at), 2.15, 0.1) << "where one is stopped by a fault";
  seek(Time(2500ms));
  EXPECT_EQ(panel_->view().machine.mode, Mode::kFault);
  ASSERT_NE(panel_->beside_view(), nullptr);
  EXPECT_EQ(panel_->beside_view()->machine.mode, Mode::kEngaged);
}

/// A recording that began at this time of its computer's clock.
std::string begun_at(const test::TemporaryFolder& folder, std::int64_t unix_ns) {
  recording::Head head = test::head_of(test::recorded("press"));
  head.virtual_time = false;
  head.started_unix_ns = unix_ns;
  return test::edited(folder, "press", head);
}

TEST(Beside, IsOnTheSameClockWhereBothWereRecordedAtTheSameTime) {
  constexpr std::int64_t kBegan_ns = 1'700'000'000'000'000'000;
  const test::TemporaryFolder folder;
  const player::Played played = player::load({begun_at(folder, kBegan_ns)});
  const auto later = [&](std::int64_t began_ns) {
    ConsoleOptions options;
    options.beside = {begun_at(folder, began_ns)};
    return beside_of(options, played)->later;
  };
  EXPECT_EQ(later(kBegan_ns + 500'000'000), -500ms) << "the same moment is earlier in its own time";
  EXPECT_EQ(later(kBegan_ns + 3'600'000'000'000), 0ms) << "of another hour: from the beginnings on";
}

TEST(PlayerCommand, RefusesInOneLineWhatCannotBePlayed) {
  const std::string press = "--replay " + test::recorded("press") + " ", sources = test::source_dir();
  const std::vector<RefusedOptions> refused{
      {press + "--simulate", "--simulate: does not go with --replay"},
      {press + "--machine solar015", "--machine: does not go with --replay"},
      {press + "--device hid", "--device hid: does not go with --replay"},
      {"--simulate --with solar015", "--with: goes with --replay"},
      {"--simulate --beside x.mcap", "--beside x.mcap: goes with --replay"},
      {press + "--control cues --beside x.mcap", "--beside x.mcap: does not go with --with or --control"},
      {press + "--at 99", "--at 99: must be"},
      {press + "--with /dev/null", "/dev/null: cannot be read: is not a regular file"},
      {press + "--with " + sources + "/config/scenarios/wall_contact.toml",
       "wall_contact.toml: is neither a machine file"},
      {press + "--control none", "--control none"},
      {"--replay /no/such.mcap", "/no/such.mcap"},
      {"--replay " + sources + "/README.md", "README.md"}};
  for (const RefusedOptions& row : refused) expect_refused_options(row);
}

TEST(PlayerCommand, WritesAPictureOfTheTimeAskedFor) {
  const VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << kNoDisplay;
  const test::TemporaryFolder folder;
  const std::string options = "--replay " + test::recorded("press") + " --screen hydraulics --at ";
  const auto picture = [&](const std::string& at, const std::string& name) {
    const Ended ended = console_run(options + at + " --screenshot " + folder.file(name));
    EXPECT_EQ(ended.code, 0) << ended.said;
    return test::content(folder.file(name));
  };
  const std::string one = picture("1.5", "a.png");
  EXPECT_GT(one.size(), 10'000u);
  EXPECT_NE(one, picture("2.5", "b.png"));
}

}  // namespace
}  // namespace knuckle::console::window
