#include "app/console/window/console_program.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <regex>

#include "app/cli/command.h"
#include "app/console/console_log.h"
#include "core/error.h"

namespace knuckle::console::window {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double thread_cpu_s() {
  std::timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::int64_t heap_bytes() {
  return static_cast<std::int64_t>(mallinfo2().uordblks);
}

constexpr std::uint64_t kSettled = 3;              // frames: ImGui lays some things out by the one before
constexpr const char* kOfRecording = "recording";  // code of rows about it, which it has from its recorder

/// Rows of the book that the recording does not have yet.
void record_events(ConsoleHost& host, const EventBook& events, std::uint64_t& recorded) {
  const auto begin = std::find_if(events.rows().begin(), events.rows().end(),
                                  [&recorded](const EventRow& row) { return row.number > recorded; });
  for (auto row = begin; row != events.rows().end(); ++row) {
    recorded = row->number;
    if (row->code != kOfRecording) host.log().note(*row);
  }
}

void take_events(ConsoleHost& host, EventBook& events, std::uint64_t& recorded, const screens::ConsoleFacts& facts) {
  ConsoleEvent event;
  while (host.next(event))
    events.add(event, facts.machine.bus, host.view().led_by_scenario ? HandSource::kDevice : facts.hand);
  record_events(host, events, recorded);
  const ConsoleView& view = host.view();
  events.note_lost(view.now, view.run, host.events_lost());
  for (const cli::News& news : host.log().news())
    events.add(view.now, view.run, news.kind == kOfRecording ? Severity::kWarning : Severity::kInfo, kOfRecording,
               news.what);
}

/// A row for each bookmark set since. @param set so far.
void take_bookmarks(const ConsoleHost& host, const ConsoleView& view, EventBook& events, std::uint32_t& set,
                    std::uint32_t wanted) {
  while (set != wanted)
    events.add(view.now, view.run, Severity::kInfo, "bookmark",
               "bookmark " + std::to_string(++set) +
                   (host.log().light().state == RecordingLight::State::kOn ? "" : ", of which nothing is recorded"));
}

/// Reports once that the log of the bus has gaps, and that it cannot be written. @param told whether gaps were
/// reported.
void watch_log(ConsoleHost& host, EventBook& events, programs::AskedOutput* log, bool& told) {
  if (log == nullptr) return;
  const ConsoleView& view = host.view();
  const std::string refused = log->tend();
  if (!refused.empty()) events.add(view.now, view.run, Severity::kWarning, "frames_lost", refused);
  told |= !refused.empty();
  if (told || host.frames_lost() + log->records_lost() == 0) return;
  told = true;
  events.add(view.now, view.run, Severity::kWarning, "frames_lost",
             "frames are missing in the candump log from here on: the window or the log's reader was too slow");
}

/// Restarts the session with what was chosen since; a refused choice is an event, and the session continues as it was.
void begin_anew(ConsoleWindow& window, ConsoleHost& host, EventBook& events, const ConsoleRun& run,
                std::uint32_t resets) {
  const screens::SimulationChoice& choice = window.state().simulation;
  try {
    host.choose(next_session(*run.simulated, choice, window.facts()),
                choice.demo ? LiveSession::Led::kByScenario : LiveSession::Led::kByPerson);
    window.show_world(host.session()->scenario.world);
    show_session(window.state(), host);
  } catch (const InputError& error) {
    events.add(host.view().now, host.view().run, Severity::kWarning, "session", error.what());
    window.state().reset_count = resets;
  }
}

void skip(ConsoleWindow& window, ConsoleHost& host, EventBook& events, std::uint64_t& recorded, const ConsoleRun& run) {
  for (double at_s = 0; at_s < run.skip_to_s && run.keep_on();) {
    at_s = std::min(run.skip_to_s, at_s + History::kStep_s);
    host.skip_to(at_s);
    window.watch(host.view());
    take_events(host, events, recorded, window.facts());
  }
}

}  // namespace

session::SimulateOptions next_session(const session::SimulateOptions& asked, const screens::SimulationChoice& choice,
                                      const screens::ConsoleFacts& facts) {
  session::SimulateOptions options = asked;
  options.scenario = facts.scenarios[static_cast<std::size_t>(choice.scenario)];
  if (!choice.link_chosen) return options;
  options.delay_ms = static_cast<double>(choice.delay_ms);
  options.jitter_ms = static_cast<double>(std::min(choice.jitter_ms, choice.delay_ms));  // no delay is below 0
  options.loss = static_cast<double>(choice.loss_percent) / 100;
  return options;
}

void show_session(screens::UiState& state, const ConsoleHost& host) {
  const session::SessionSetup& session = *host.session();
  screens::SimulationChoice& choice = state.simulation;
  choice.delay_ms = static_cast<float>(to_seconds(session.to_machine.delay) * 1e3);
  choice.jitter_ms = static_cast<float>(to_seconds(session.to_machine.jitter) * 1e3);
  choice.loss_percent = static_cast<float>(session.to_machine.loss * 100);
  if (choice.scenario != state.running.scenario) {
    state.assist = session.scenario.assist;
    if (state.assist.force_limit_N > 0) state.assist_limit_N = static_cast<float>(state.assist.force_limit_N);
  }
  state.running = choice;
}

void take_pictures(const screens::CameraPane& cameras, ConsoleHost& host, EventBook& events, PictureLog& pictures) {
  const ConsoleView& view = host.view();
  for (const screens::CameraPane::Taken& taken : cameras.taken()) {
    host.log().note(view.run, taken.stamp);
    pictures.show(view.run, taken.stamp, taken.frame);
  }
  for (const PictureLog::Made& made : pictures.made()) host.log().note(made.run, made.picture);
  for (const std::string& problem : pictures.problems())
    events.add(view.now, view.run, Severity::kWarning, "camera", problem);
}

ConsoleOutcome run_console(ConsoleWindow& window, ConsoleHost& host, const ConsoleRun& run) {
  constexpr double kWarmUp_s = 1;  // textures, shaders and buffers find their sizes
  EventBook events;
  PictureLog pictures(run.pictures_per_s);
  ConsoleOutcome outcome;
  if (host.session()) window.show_world(host.session()->scenario.world);
  std::uint64_t recorded = 0;
  skip(window, host, events, recorded, run);
  const bool picture_only = !run.screenshot.empty() && run.duration_s <= 0;
  if (!picture_only) host.begin();
  const Clock::time_point begin = Clock::now();
  const double cpu_before_s = thread_cpu_s();
  std::int64_t heap_before = heap_bytes();
  bool warm = false, gamepad_there = true, holes_told = false;
  std::uint32_t resets = window.state().reset_count, bookmarks = window.state().bookmarks;
  for (bool last = false; !last && !window.closing() && run.keep_on();) {
    last = picture_only ? outcome.frames + 1 >= kSettled : since(begin) >= run.duration_s;
    take_events(host, events, recorded, window.facts());
    watch_log(host, events, run.candump, holes_told);
    const Time looked_at = host.now();  // at what is held, and no later
    const ConsoleView& view = host.view();
    const LoopHealth& health = host.health();
    if (run.link_news)
      for (const cli::News& news : run.link_news()) events.add(view.now, view.run, Severity::kInfo, "link", news.what);
    if (window.facts().hand == HandSource::kGamepad) {
      const std::optional<GamepadState> gamepad = window.window().gamepad();
      window.take_gamepad(gamepad);
      if (gamepad.has_value() != gamepad_there)
        events.add(view.now, view.run, gamepad ? Severity::kInfo : Severity::kWarning, "gamepad",
                   gamepad ? "gamepad connected again: press and release enable, then press it again"
                           : "gamepad disconnected: plug it in");
      gamepad_there = gamepad.has_value();
    }
    window.show_recording(host.log().light());
    window.frame(view, health, events, picture_only ? 0 : host.view_age_s());
    take_pictures(window.cameras(), host, events, pictures);
    take_bookmarks(host, view, events, bookmarks, window.state().bookmarks);
    if (last && warm) outcome.heap_growth_bytes = heap_bytes() - heap_before;
    if (last && !run.screenshot.empty()) window.write_png(run.screenshot);
    if (!picture_only) {  // before the frame is shown, which may take its time
      if (run.simulated && window.state().reset_count != resets) begin_anew(window, host, events, run, resets);
      resets = window.state().reset_count;
      host.put(window.input(looked_at));
    }
    window.show();
    ++outcome.frames;
    if (!warm && since(begin) > kWarmUp_s) {
      warm = true;
      heap_before = heap_bytes();
    }
  }
  outcome.ran_s = since(begin);
  outcome.ui_cpu_share = (thread_cpu_s() - cpu_before_s) / std::max(outcome.ran_s, 1e-9);
  outcome.simulated_s = host.view().simulated_s;
  outcome.mode = name(host.view().machine.mode);
  host.end_loop();
  take_events(host, events, recorded, window.facts());
  record_events(host, events, recorded);
  host.stop();
  outcome.events_lost = host.events_lost();
  outcome.frames_lost = host.frames_lost();
  return outcome;
}

namespace {

std::string name_of(const std::string& file) {
  return std::filesystem::path(file).filename().string();
}

screens::ConsoleFacts facts_of(const player::Played& played) {
  screens::ConsoleFacts facts;
  facts.machine = played.machine;
  if (played.device) facts.device = *played.device;
  facts.hand = HandSource::kDevice;
  facts.peer = name_of(played.file);
  return facts;
}

/// Numbers with so many digits as a person compares.
std::string readable(const std::string& text) {
  static const std::regex kLong(R"((\d+\.\d{5})\d+)");
  return std::regex_replace(text, kLong, "$1");
}

screens::Beside rerun_beside(const ConsoleOptions& o, const player::Played& played) {
  player::Rerun again = player::rerun(o.replay, o.changes, played.run);
  screens::Beside beside;
  beside.name = "re-run";
  for (const recording::SideResult& side : again.result.sides) {
    if (!side.first) continue;
    if (!beside.differs_at || side.first->at < *beside.differs_at) beside.differs_at = side.first->at;
    beside.differs.push_back(fmt::format("{} differs from {:.3f} s on: {}", recording::name(side.first->side),
                                         to_seconds(side.first->at), readable(side.first->what.front())));
  }
  if (beside.differs.empty()) beside.differs.emplace_back("The loops do the same, bit by bit.");
  beside.run = std::move(again.run);
  return beside;
}

/// On the computers' clocks where both have one and overlap; else from their beginnings on.
Duration later_by(const player::Played& played, const player::Played& other) {
  const bool clocks = played.head.started_unix_ns != 0 && other.head.started_unix_ns != 0;
  const Duration apart(played.head.started_unix_ns - other.head.started_unix_ns);
  const bool overlap = played.run.first() + apart <= other.run.last() && other.run.first() <= played.run.last() + apart;
  return clocks && overlap ? apart : other.run.first() - played.run.first();
}

/// Where the machine's modes first differ, on the time line.
void compare_modes(const player::Played& played, screens::Beside& beside) {
  constexpr Duration kLook = 5ms, kApart = 50ms;  // the same change a few steps later is the same
  if (played.run.data().sensors_alone || beside.run.data().sensors_alone)
    return (void)beside.differs.emplace_back("An imported table has no modes to compare.");
  Time since = kNever;
  for (Time at = played.run.first(); at <= played.run.last(); at += kLook) {
    const player::MachineStep* const one = played.run.machine_at(at);
    const player::MachineStep* const two = beside.run.machine_at(at + beside.later);
    const bool known = played.run.recorded(at) && beside.run.recorded(at + beside.later);
    const bool differ = known && one != nullptr && two != nullptr && one->told.mode != two->told.mode;
    if (!differ) since = kNever;
    if (!differ) continue;
    if (since == kNever) since = at;
    if (at - since < kApart) continue;
    beside.differs_at = since;
    beside.differs.push_back(fmt::format("modes differ from {:.2f} s on: {}, beside it {}", to_seconds(since),
                                         name(one->told.mode), name(two->told.mode)));
    return;
  }
  beside.differs.emplace_back("The machine's modes do not differ.");
}

screens::Beside recorded_beside(const ConsoleOptions& o, const player::Played& played) {
  player::Played other = player::load(o.beside);
  for (const std::string& note : other.notes) std::cerr << "knuckle console: " << note << '\n';
  screens::Beside beside;
  beside.name = name_of(other.file);
  beside.later = later_by(played, other);
  beside.run = std::move(other.run);
  compare_modes(played, beside);
  return beside;
}

}  // namespace

std::optional<screens::Beside> beside_of(const ConsoleOptions& o, const player::Played& played) {
  if (o.changes.any()) return rerun_beside(o, played);
  if (!o.beside.empty()) return recorded_beside(o, played);
  return std::nullopt;
}

int run_player(const ConsoleOptions& o, const std::function<bool()>& keep_on) {
  player::Played played = player::load(o.replay);
  for (const std::string& note : played.notes) std::cerr << "knuckle console: " << note << '\n';
  cli::check_range("--at", o.at_s, to_seconds(played.run.first()), to_seconds(played.run.last()), " s");
  std::optional<screens::Beside> beside = beside_of(o, played);
  screens::PlayerPanel panel(std::move(played), std::move(beside));
  panel.timeline().seek(o.at_s ? Time(from_seconds(*o.at_s)) : panel.played().run.first_heard());
  ConsoleWindow window(o.window(), facts_of(panel.played()));
  window.state().screen = o.first_screen();
  window.state().units = o.imperial ? UnitSystem::kImperial : UnitSystem::kMetric;
  if (panel.played().world) window.show_world(*panel.played().world);
  window.play(panel);
  const bool picture_only = !o.screenshot.empty() && !o.duration_s;
  if (!o.screenshot.empty()) window.hold_steady();
  const Clock::time_point begin = Clock::now();
  Clock::time_point drawn = begin;
  bool last = false;
  for (std::uint64_t frame = 1; !last && !window.closing() && keep_on(); ++frame) {
    const Clock::time_point now = Clock::now();
    last = picture_only ? frame >= kSettled : o.duration_s && since(begin) >= *o.duration_s;
    panel.pass(std::chrono::duration<double>(now - drawn).count());
    drawn = now;
    window.frame_of_player();
    if (last && !o.screenshot.empty()) window.write_png(o.screenshot);
    window.show();
  }
  return 0;
}

}  // namespace knuckle::console::window
