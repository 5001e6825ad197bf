// The console's screens in a real window: reached by keys; some compared with pictures that somebody has looked at, of
// the others what must be read there.
// KNUCKLE_WRITE_GOLDENS=1 writes those (scripts/console-pictures --goldens).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/console/window/canned_console.h"
#include "tests/console/window/drawn_texts.h"
#include "tests/console/window/virtual_display.h"
#include "tests/support/places.h"
#include "tests/support/two_buses.h"

namespace knuckle::console::window {
namespace {

namespace fs = std::filesystem;

/// Share of the pixels that differ by more than a driver's smoothing of edges does, by ImageMagick; 1 where the two
/// cannot be compared.
double picture_error(const std::string& a, const std::string& b, double pixels) {
  const std::string command = "compare -metric AE -fuzz 10% '" + a + "' '" + b + "' null: 2>&1";
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::array<char, 256> line{};
  double different = pixels;
  if (pipe && std::fgets(line.data(), line.size(), pipe.get()) != nullptr)
    if (std::sscanf(line.data(), "%lf", &different) != 1) ADD_FAILURE() << line.data();
  return different / pixels;
}

struct Shot {
  std::string name, size = "1280x800";
  float scale = 0;
  bool light = false;
  std::vector<std::string> keys{};
  std::vector<std::string> texts{};  ///< What must be seen, whole.
  double silence_s = 0.004;          ///< Since the machine was heard.
  double view_age_s = 0;             ///< Since the loop told anything.
  void (*prepare)(ConsoleView&, screens::UiState&) = [](ConsoleView&, screens::UiState&) {};
  RecordingLight recording = canned_recording();
  screens::ConsoleFacts (*facts)() = canned_facts;
};
RecordingLight stopped_recording() {
  return {RecordingLight::State::kStopped, true, 0, 0, "only 255 MiB are left on the disk"};
}
/// A machine that is elsewhere; the tags above are at their widest.
void real_machine(ConsoleView& view, screens::UiState&) {
  view.simulated = false;
  view.hand.warning = {ReasonCode::kEnergyWatchdog, 0, 0.04F, 0.03F};
}
/// Nothing is to be trusted: no force is known, the oil is at its relief, a joint at its end, the link loses a third.
void untrusted(ConsoleView& view, screens::UiState& state) {
  view.machine.confidence = 0;
  view.machine.pressure_Pa[0] = 260e5;
  view.machine.position_rad[kBucket] = 10;
  view.link.loss = 0.31;
  view.status.calibrated = false;
  view.status.force_doubts = estimation::kBadInput;
  state.hold_to_run = true;
}
void stopped_by_hand(ConsoleView& view, screens::UiState& state) {
  view.machine.mode = Mode::kFault;
  view.machine.fault = {ReasonCode::kOperatorStop, 0, 0, 0};
  view.machine.blocking = {ReasonCode::kReleaseToRecover, 0, 0, 0};
  state.typing = true;
}
/// Its spools are not measured.
screens::ConsoleFacts no_spool_facts() {
  screens::ConsoleFacts facts = canned_facts();
  facts.machine = load_machine(find_config("machine", "standard200"));
  return facts;
}
screens::ConsoleFacts two_buses_facts() {
  screens::ConsoleFacts facts = canned_facts();
  facts.machine = parse_machine(test::two_buses_text(), "m.toml");
  facts.machine.bus.second->name = "machines_own_front_bus";  // as long as it may be
  return facts;
}
void both_buses_bad(ConsoleView& view, screens::UiState&) {
  view.status.buses = {{{0.41, CanState::kBusOff}, {1, CanState::kPassive}}};
}
void by_scenario(ConsoleView& view, screens::UiState&) {
  view.led_by_scenario = true;
  view.hand.assist = {2500, true};
}
void loaded(ConsoleView& view, screens::UiState& state) {
  view.machine.payload_kg = 64;
  state.measures.grade.slope = -0.1;
  state.force_most_N = 1500;
}
void asked_for_more(ConsoleView& view, screens::UiState& state) {
  view.hand.assist = {1500, true};
  state.scales_chosen = true;
  state.position_scale = 12.5F;
  state.force_scale = 2000;
  state.assist = {0, true};
}
void PrintTo(const Shot& shot, std::ostream* out) {
  *out << shot.name;
}

/// A console as a shot has it, on a display that is up.
class Shown {
 public:
  explicit Shown(const Shot& shot) : shot_(shot), console_(options_of(shot), shot.facts()) {
    console_.hold_steady();
    console_.show_world(canned_world());
    console_.show_recording(shot.recording);
    view_.link.silence_s = view_.status_age_s = shot.silence_s;
    screens::SimulationChoice& choice = console_.state().simulation;
    choice.delay_ms = 10;
    choice.scenario = 1;
    console_.state().running = choice;
    shot.prepare(view_, console_.state());
    fill(events_, console_.facts().machine.bus);
    with_history(view_, [&](const ConsoleView& v) { console_.watch(v); });
    frames(3);
    for (const std::string& key : shot.keys) {
      EXPECT_TRUE(xdotool("key " + key));
      console_.show();
      frames(3);
    }
  }
  static WindowOptions options_of(const Shot& shot) {
    WindowOptions options{.scale = shot.scale, .light = shot.light, .full_speed = true};
    EXPECT_EQ(std::sscanf(shot.size.c_str(), "%dx%d", &options.width, &options.height), 2);
    return options;
  }
  void frames(int n) {
    for (int i = 0; i < n; ++i) {
      console_.frame(view_, loop_, events_, shot_.view_age_s);
      if (i + 1 < n) console_.show();
    }
  }
  [[nodiscard]] const ConsoleWindow& console() const noexcept { return console_; }

 private:
  const Shot& shot_;
  ConsoleWindow console_;
  ConsoleView view_ = canned_view();
  const LoopHealth loop_ = canned_loop();
  EventBook events_;
};

class Screens : public testing::TestWithParam<Shot> {
 protected:
  static constexpr double kTolerance = 1e-3;  // 1024 pixels of 1280x800: a few words
};

TEST_P(Screens, AreReachedByKeysAndLookAsTheyDid) {
  const Shot& shot = GetParam();
  const VirtualDisplay display(shot.size);
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  const Shown shown(shot);
  const fs::path golden = fs::path(test::source_dir()) / "tests/console/window/golden" / (shot.name + ".png");
  const fs::path now = fs::temp_directory_path() / ("knuckle-console-" + shot.name + ".png");
  if (std::getenv("KNUCKLE_WRITE_GOLDENS") != nullptr) return shown.console().write_png(golden);
  shown.console().write_png(now);
  const WindowOptions size = Shown::options_of(shot);
  EXPECT_LE(picture_error(golden, now, double(size.width) * size.height), kTolerance) << now << " is not as " << golden;
}

INSTANTIATE_TEST_SUITE_P(Console, Screens,
                         testing::Values(Shot{.name = "operate"}, Shot{.name = "hydraulics", .keys = {"F4"}},
                                         Shot{.name = "history", .keys = {"F7"}},
                                         Shot{.name = "link_light", .light = true, .keys = {"F2"}}),
                         [](const auto& shot) { return shot.param.name; });

/// The recording's light as it is widest; its other texts are tested as texts (RecordingText).
const std::vector<Shot> kWholeScreens{
    Shot{.name = "real_time_two_buses",
         .size = "1280x720",
         .keys = {"F3"},
         .texts = {"Wake-up lateness", "61 µs", "Overruns", "SCHED_FIFO 80", "CAN valves load", "41", "bus-off",
                   "CAN machines_own_front_bus load", "100", "error-passive", "CAN errors", "Passes the full force"},
         .prepare = both_buses_bad,
         .facts = two_buses_facts},
    Shot{.name = "calibration",
         .keys = {"F5"},
         .texts = {"CALIBRATION IN FORCE", "HOW SURE IT IS", "212 N m", "900 N ± 49 N"},
         .facts = calibrated_facts},
    Shot{.name = "drawing_alone",
         .keys = {"F5"},
         .texts = {"Never identified: masses, friction and forces are those of a drawing.",
                   "The machine's side is calibrated, this console's machine file is not: give both the same "
                   "file."}},
    Shot{.name = "events",
         .keys = {"F6"},
         .texts = {"11 shown, 11 in total", "Ack",
                   "machine: fault, arm_valve (node 0x11): sensor has stopped sending: check node and cable (41 ms; "
                   "limit 25 ms)"}},
    Shot{.name = "measures",
         .keys = {"g", "t"},
         .texts = {"chosen ground", "over the grade line", "-10.0", "64.0"},
         .prepare = loaded},
    Shot{.name = "help",
         .keys = {"F12"},
         .texts = {"Stop is software: it requests a stop over the link. It is not an emergency stop; the machine "
                   "has its own, hard-wired."}},
    Shot{.name = "operate_stale", .texts = {"LINK LOST", "was ENGAGED, 1.2 s old", "1.2 s old"}, .silence_s = 1.24},
    Shot{.name = "hydraulics_stale", .keys = {"F4"}, .texts = {"1.2 s old", "-"}, .silence_s = 1.24},
    Shot{.name = "operate_by_scenario",
         .texts = {"the machine follows the scenario's operator", "Hand on the device", "2500 N"},
         .prepare = by_scenario},
    Shot{.name = "stopped_by_hand",
         .texts = {"STOPPED",
                   "stop was pressed: release enable, then press again; now: the bucket still presses with 1500 N; "
                   "fault is over: release enable, then press again"},
         .prepare = stopped_by_hand},
    Shot{.name = "operate_asked",
         .light = true,
         .texts = {"now 10", "12.5 : 1", "now 1000", "2000 : 1", "now 1500 N"},
         .prepare = asked_for_more},
    Shot{.name = "stopped_unheard",
         .size = "1280x720",
         .light = true,
         .keys = {"space"},
         .texts = {"STOP PRESSED",
                   "Stop is pressed, but nothing received from the machine for 1.2 s: do not rely on it, use the "
                   "machine's own E-stop"},
         .silence_s = 1.24},
    Shot{.name = "loop_silent",
         .texts = {"CONSOLE HANGS",
                   "this console's own loop has not run for 3.1 s: close the console and start it again"},
         .view_age_s = 3.1},
    Shot{.name = "operate_720",
         .size = "1280x720",
         .texts = {"ENGAGED", "STOP", "FORCE ON THE BUCKET TIP", "joint range", "to the reach limit"}},
    Shot{.name = "untrusted", .texts = {"ENGAGED", "UNCALIBRATED: OK?"}, .prepare = untrusted},
    Shot{.name = "spool_of_a_model", .keys = {"F9", "F4"}, .texts = {"model"}, .facts = no_spool_facts},
    Shot{.name = "recording_stopped",
         .size = "1024x768",
         .texts = {"REC STOPPED: only 255 MiB are left on the disk"},
         .prepare = real_machine,
         .recording = stopped_recording()}};

TEST(ScreensTexts, AreSeenWhole) {
  const VirtualDisplay display("1280x800");
  if (!display.up()) GTEST_SKIP() << "console: SKIPPED, no Xvfb here (package xvfb)";
  for (const Shot& shot : kWholeScreens) {
    SCOPED_TRACE(shot.name);
    Shown shown(shot);
    const std::vector<DrawnText> drawn = texts_of([&] { shown.frames(1); });
    for (const std::string& text : shot.texts)
      EXPECT_TRUE(std::any_of(drawn.begin(), drawn.end(),
                              [&](const DrawnText& one) { return one.text == text && one.cut_px == 0; }))
          << "is not seen whole: " << text;
  }
}

}  // namespace
}  // namespace knuckle::console::window
