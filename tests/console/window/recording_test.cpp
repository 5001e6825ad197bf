// The recording as a person at the window has it: its light in words, bookmarks by a key, flight records by name.
#include <gtest/gtest.h>

#include <algorithm>

#include "app/console/screens/screens.h"
#include "app/console/window/console_program.h"
#include "tests/console/recorded.h"
#include "tests/console/window/canned_console.h"
#include "tests/console/window/virtual_display.h"

namespace knuckle::console::window {
namespace {

using State = RecordingLight::State;

TEST(RecordingText, SayWhatIsRecordedForHowLongAndWhatRoomIsLeft) {
  EXPECT_EQ(screens::recording_text({State::kOn, true, 12'340'000'000, 0, ""}, 3754.9).light, "REC 1:02:34");
  EXPECT_EQ(screens::recording_text({State::kOn, true, 12'340'000'000, 0, ""}, 1).note, "12.3 GB free");
  EXPECT_EQ(screens::recording_text({State::kOn, true, 0, 0, ""}, 1).note, "") << "not known yet";
  EXPECT_EQ(screens::recording_text({State::kOn, true, 1'000'000'000, 7, ""}, 1).note, "1.0 GB free, 7 steps lost");
  EXPECT_EQ(screens::recording_text({State::kOff, false, 0, 0, ""}, 1).light, "NOT RECORDED");
  EXPECT_EQ(screens::recording_text({State::kStopped, true, 5, 0, "no space"}, 1).light, "REC STOPPED: no space");
}

class RecordedConsole : public testing::Test {
 protected:
  void SetUp() override {
    if (!display_.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  }
  /// A simulated session behind a real window. @param each called in every frame, until it is false.
  ConsoleOutcome run(LogChoice log, const std::function<bool(ConsoleWindow&, ConsoleHost&)>& each) {
    session::SimulateOptions options;
    options.scenario = "free_motion";
    ConsoleHost host(options, LiveSession::Led::kByPerson, nullptr, nullptr, std::move(log));
    ConsoleWindow window({}, canned_facts());
    window.state().simulation.scenario = 2;
    ConsoleRun run;
    run.simulated = options;
    run.duration_s = 60;
    run.keep_on = [&] { return each(window, host); };
    return run_console(window, host, run);
  }
  LogChoice into_folder() {
    LogChoice log;
    log.options.folder = folder_.path().string();
    return log;
  }
  static std::vector<std::string> texts(const std::string& file, const std::string& kind) {
    std::vector<std::string> found;
    for (const recording::Event& event : test::events_of(file))
      if (event.kind == kind) found.push_back(event.text);
    return found;
  }

  VirtualDisplay display_{"1280x800"};
  test::TemporaryFolder folder_;
};

TEST_F(RecordedConsole, TheKeyBSetsABookmarkAtThatTimeInTheSessionThatRuns) {
  using Texts = std::vector<std::string>;
  int pressed = 0;
  const double pressed_at_s[] = {0.4, 0.8, 0.4};
  (void)run(into_folder(), [&](ConsoleWindow& window, ConsoleHost& host) {
    const ConsoleView& view = host.view();
    const std::uint32_t run = pressed < 2 ? 1 : 2;
    if (pressed < 3 && view.run == run && view.simulated_s > pressed_at_s[pressed]) {
      EXPECT_TRUE(xdotool("key b"));
      ++pressed;
    }
    if (pressed == 2 && window.state().bookmarks == 2 && view.run == 1) window.state().reset_count = 1;
    return window.state().bookmarks < 3 || view.simulated_s < 0.8;
  });
  const auto files = test::recorded_in(folder_);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(texts(files[0], "bookmark"), (Texts{"bookmark 1", "bookmark 2"}));
  EXPECT_EQ(texts(files[1], "bookmark"), Texts{"bookmark 3"});
  const auto events = test::events_of(files[0]);
  const auto bookmark = std::find_if(events.begin(), events.end(), [](const auto& e) { return e.kind == "bookmark"; });
  EXPECT_GE(bookmark->at, Time(400ms));
  EXPECT_FALSE(texts(files[0], "mode").empty()) << "and what else the events screen shows";
}

TEST_F(RecordedConsole, WhatHappensInTheLastFrameIsRecorded) {
  (void)run(into_folder(), [&](ConsoleWindow& window, ConsoleHost& host) {
    const bool pressed = window.state().stop;
    window.state().stop = host.view().simulated_s > 0.5;
    return !pressed;
  });
  EXPECT_FALSE(texts(test::recorded_in(folder_).front(), "stop").empty());
}

TEST_F(RecordedConsole, TheRecordingNamesTheFlightRecordOfAStop) {
  (void)run(into_folder(), [&](ConsoleWindow& window, ConsoleHost& host) {
    const ConsoleView& view = host.view();
    window.state().stop = view.simulated_s > 2;
    return view.simulated_s < 2.5;
  });
  const auto flights = test::recorded_in(folder_, true);
  ASSERT_EQ(flights.size(), 1u);
  const std::vector<std::string> told = texts(test::recorded_in(folder_).front(), "recorder");
  EXPECT_EQ(told, std::vector<std::string>{"flight record: " + flights.front()});
}

}  // namespace
}  // namespace knuckle::console::window
