#include "app/console/window/player_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <regex>

#include "app/cli/command.h"
#include "app/console/player/rerun.h"
#include "app/console/window/console_window.h"

namespace knuckle::console::window {
namespace {

using Clock = std::chrono::steady_clock;

std::string name_of(const std::string& file) {
  return std::filesystem::path(file).filename().string();
}

screens::ConsoleFacts facts_of(const player::Played& played) {
  screens::ConsoleFacts facts;
  facts.machine = played.machine;
  if (played.device) facts.device = *played.device;
  facts.hand = screens::HandSource::kDevice;
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
    const bool differ = known && one != nullptr && two != nullptr && one->mode != two->mode;
    if (!differ) since = kNever;
    if (!differ) continue;
    if (since == kNever) since = at;
    if (at - since < kApart) continue;
    beside.differs_at = since;
    beside.differs.push_back(fmt::format("modes differ from {:.2f} s on: {}, beside it {}", to_seconds(since),
                                         name(one->mode), name(two->mode)));
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
  window.state().units = o.imperial ? widgets::UnitSystem::kImperial : widgets::UnitSystem::kMetric;
  window.state().export_path = "knuckle-events.csv";
  if (panel.played().world) window.show_world(*panel.played().world);
  window.play(panel);
  const bool picture_only = !o.screenshot.empty() && !o.duration_s;
  if (!o.screenshot.empty()) window.hold_steady();
  constexpr int kSettled = 3;  // ImGui lays some things out by the frame before
  const Clock::time_point begin = Clock::now();
  Clock::time_point drawn = begin;
  bool last = false;
  for (int frame = 1; !last && !window.closing() && keep_on(); ++frame) {
    const Clock::time_point now = Clock::now();
    const double since_s = std::chrono::duration<double>(now - begin).count();
    last = picture_only ? frame >= kSettled : o.duration_s && since_s >= *o.duration_s;
    panel.pass(std::chrono::duration<double>(now - drawn).count());
    drawn = now;
    window.frame_of_player();
    if (last && !o.screenshot.empty()) window.write_png(o.screenshot);
    window.show();
  }
  return 0;
}

}  // namespace knuckle::console::window
