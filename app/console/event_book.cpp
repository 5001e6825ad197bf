#include "app/console/event_book.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <ctime>

#include "app/cli/output_file.h"
#include "app/console/console_view.h"
#include "app/console/machine_text.h"
#include "app/recordings/csv_row.h"

namespace knuckle::console {
namespace {

struct Told {
  Severity severity;
  std::string code, text;
};

Told machine(const ConsoleEvent& event, const BusDescription& bus, HandSource hand) {
  const bool stopped = event.mode == Mode::kFault || event.mode == Mode::kEStop;
  const std::string mode = std::string("machine: ") + name(event.mode);
  const std::string why = event.reason ? ", " + reason_text(event.reason, bus, hand) : "";
  return {stopped ? Severity::kAlarm : Severity::kInfo, stopped && event.reason ? name(event.reason.code) : "mode",
          mode + why};
}

Told device(const ConsoleEvent& event) {
  if (!event.reason) return {Severity::kInfo, "device", "haptic device is ready"};
  const bool starting = event.reason.code == ReasonCode::kStartingUp;
  return {starting ? Severity::kInfo : Severity::kWarning, name(event.reason.code),
          starting ? "haptic device is starting up" : text(event.reason)};
}

Told piece(const ConsoleEvent& event) {
  using sim::WorldEventKind;
  static constexpr std::array kTexts{
      "bucket in contact",         "bucket out of contact", "piece broke off at {:.0f} N", "piece on the ground",
      "piece scooped: {:.0f} kg",  "dug: {:.0f} kg",        "dumped: {:.0f} kg",           "pipe touched",
      "weight hung on: {:.0f} kg", "weight taken off"};
  static_assert(kTexts.size() == static_cast<std::size_t>(WorldEventKind::kWeightOff) + 1);
  return {event.piece == WorldEventKind::kPipeTouched ? Severity::kWarning : Severity::kInfo, "piece",
          fmt::format(fmt::runtime(kTexts[static_cast<std::size_t>(event.piece)]), event.value)};
}

Told told(const ConsoleEvent& event, const BusDescription& bus, HandSource hand) {
  switch (event.kind) {
    case ConsoleEventKind::kMachine:
      return machine(event, bus, hand);
    case ConsoleEventKind::kBlocked:
      return {Severity::kInfo, name(event.reason.code), reason_text(event.reason, bus, hand)};
    case ConsoleEventKind::kDevice:
      return device(event);
    case ConsoleEventKind::kLink:
      return event.on ? Told{Severity::kInfo, "link", "packets from the machine received"}
                      : Told{Severity::kAlarm, "link", "no packets from the machine: check the network"};
    case ConsoleEventKind::kContact:
      return {Severity::kInfo, "contact",
              event.on ? fmt::format("contact, {:.0f} N", event.value) : std::string("contact ended")};
    case ConsoleEventKind::kTooMuch:
      return event.on ? Told{Severity::kWarning, "too_much",
                             fmt::format("force on the tip is too much: {:.0f} N; maximum set {:.0f} N", event.value,
                                         event.limit)}
                      : Told{Severity::kInfo, "too_much", "force on the tip is below the maximum set again"};
    case ConsoleEventKind::kPiece:
      return piece(event);
    case ConsoleEventKind::kStop:
      return event.on ? Told{Severity::kWarning, "stop", "Stop pressed"}
                      : Told{Severity::kInfo, "stop", "Stop released: release enable, then press it again"};
    case ConsoleEventKind::kInput:
      return event.on ? Told{Severity::kInfo, "input", "window responds again: release enable, then press it again"}
                      : Told{Severity::kWarning, "input", "window stalled: inputs count as released"};
    case ConsoleEventKind::kAttended:
      return {Severity::kInfo, "input",
              event.on ? "window has the focus: release enable, then press it again"
                       : "window lost the focus: inputs count as released"};
    case ConsoleEventKind::kScales:
      return event.on ? Told{Severity::kInfo, "scales", "scales applied"}
                      : Told{Severity::kInfo, "scales", "scales are locked while the machine is led"};
    case ConsoleEventKind::kWarning:
      return event.reason ? Told{Severity::kWarning, name(event.reason.code), text(event.reason)}
                          : Told{Severity::kInfo, "warning", "warning ended"};
    case ConsoleEventKind::kPaused:
      return {Severity::kInfo, "session", event.on ? "paused" : "resumed"};
    case ConsoleEventKind::kNewStart:
      return {Severity::kInfo, "session", "restarted"};
    case ConsoleEventKind::kTooSmall:
      return {Severity::kInfo, "input",
              event.on ? "window is too small: inputs count as released"
                       : "window is large enough again: release enable, then press it again"};
    case ConsoleEventKind::kOwnPause:
      return {Severity::kWarning, "input", own_pause_text(event.value) + ": that is what the fault comes of"};
  }
  return {Severity::kInfo, "?", "?"};
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

void put_row(std::ostream& out, const EventRow& event, bool names) {
  recordings::RowWriter row(out, names, "\r\n");
  row.number("number", static_cast<double>(event.number));
  row.number("run", event.run);
  row.number("time_s", to_seconds(event.at));
  row.word("severity", name(event.severity));
  row.word("code", event.code);
  row.word("text", event.text);
  row.word("acknowledged", event.acknowledged ? "yes" : "no");
  row.end_row();
}

}  // namespace

const char* name(Severity severity) noexcept {
  constexpr std::array kNames{"info", "warning", "alarm"};
  static_assert(kNames.size() == static_cast<std::size_t>(Severity::kAlarm) + 1);
  return kNames[static_cast<std::size_t>(severity)];
}

void EventBook::add(const ConsoleEvent& event, const BusDescription& bus, HandSource hand) {
  const Told line = told(event, bus, hand);
  add(event.at, event.run, line.severity, line.code, line.text);
}

void EventBook::add(Time at, std::uint32_t run, Severity severity, const std::string& code, const std::string& text) {
  rows_.push_back({++numbered_, run, at, severity, code, text, severity == Severity::kInfo});
  if (rows_.size() <= most_) return;
  auto oldest = std::find_if(rows_.begin(), rows_.end(), [](const EventRow& row) { return row.acknowledged; });
  // An alarm sounds until somebody has acknowledged it.
  const auto no_alarm = [](const EventRow& row) { return row.severity < Severity::kAlarm; };
  if (oldest == rows_.end()) oldest = std::find_if(rows_.begin(), rows_.end(), no_alarm);
  if (oldest == rows_.end()) oldest = rows_.begin();
  ++forgotten_;
  if (!oldest->acknowledged) ++forgotten_open_;
  rows_.erase(oldest);
}

void EventBook::note_lost(Time at, std::uint32_t run, std::uint64_t lost) {
  if (lost <= lost_) return;
  add(at, run, Severity::kWarning, "events_lost", std::to_string(lost - lost_) + " events lost: too many at a time");
  lost_ = lost;
}

bool EventFilter::lets_through(const EventRow& row) const {
  if (row.severity < least) return false;
  const std::string wanted = lower(text);
  return wanted.empty() || lower(row.code).find(wanted) != std::string::npos ||
         lower(row.text).find(wanted) != std::string::npos;
}

std::vector<const EventRow*> EventBook::matching(const EventFilter& filter) const {
  std::vector<const EventRow*> found;
  for (const EventRow& row : rows_)
    if (filter.lets_through(row)) found.push_back(&row);
  return found;
}

std::size_t EventBook::open(Severity least) const noexcept {
  return static_cast<std::size_t>(std::count_if(
      rows_.begin(), rows_.end(), [least](const EventRow& row) { return !row.acknowledged && row.severity >= least; }));
}

void EventBook::acknowledge(std::uint64_t number) noexcept {
  for (EventRow& row : rows_) row.acknowledged |= row.number == number;
}

void EventBook::acknowledge(const EventFilter& filter) {
  for (EventRow& row : rows_) row.acknowledged |= filter.lets_through(row);
}

std::string event_time(Time at, std::int64_t unix_ns_at_zero) {
  if (unix_ns_at_zero == 0) return fmt::format("{:.3f}", to_seconds(at));
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::int64_t unix_ns = unix_ns_at_zero + at.time_since_epoch().count();
  const auto unix_s = static_cast<std::time_t>(unix_ns / kSecond_ns);
  std::tm local{};
  ::localtime_r(&unix_s, &local);
  return fmt::format("{:02}:{:02}:{:02}.{:03}", local.tm_hour, local.tm_min, local.tm_sec,
                     unix_ns % kSecond_ns / 1'000'000);
}

std::string EventBook::export_csv(const std::string& path, const EventFilter& filter) const {
  cli::OutputFile file("export", path);
  put_row(file.stream(), {}, true);
  for (const EventRow* row : matching(filter)) put_row(file.stream(), *row, false);
  return file.commit_keeping_older();
}

namespace {

constexpr Duration kStanding = 1s;
constexpr double kWellWithin = 0.9;  // of the maximum set: a force that hovers about it is told once

}  // namespace

void EventWatch::note(Time now, ConsoleEventKind kind, bool on, double value, double limit) noexcept {
  ring_.push({.kind = kind, .at = now, .run = run_, .on = on, .value = value, .limit = limit});
}

void EventWatch::begin_anew() noexcept {
  told_ = {};
  standing_ = {};
  standing_since_ = {};
  world_read_ = 0;
  ++run_;
  note(Time{}, ConsoleEventKind::kNewStart, true);
}

void EventWatch::step(Time now, const Watched& side, const sim::WorldEventRing* world) noexcept {
  watch_operator(now, side);
  watch_machine(now, side);
  if (world != nullptr) watch_world(now, *world);
}

void EventWatch::watch_machine(Time now, const Watched& side) noexcept {
  const SlaveMessage* machine = side.machine;
  const bool heard = machine != nullptr && side.silence_s < kLinkLost_s;
  if (heard != told_.heard) note(now, ConsoleEventKind::kLink, heard);
  told_.heard = heard;
  if (!heard) return;
  if (machine->mode != told_.mode || !same_cause(machine->fault, told_.fault)) {
    told_.mode = machine->mode;
    told_.fault = machine->fault;
    told_.reason = machine->fault ? machine->fault : machine->blocking;
    ring_.push(
        {.kind = ConsoleEventKind::kMachine, .at = now, .run = run_, .mode = told_.mode, .reason = told_.reason});
  }
  if (machine->contact != told_.contact)
    note(now, ConsoleEventKind::kContact, machine->contact, machine->tip_force_N.norm());
  told_.contact = machine->contact;
  watch_force(now, *machine, side.force_most_N);
  watch_standing(now, machine->blocking);
}

/// A force without confidence tells nothing, neither way.
void EventWatch::watch_force(Time now, const SlaveMessage& machine, double most_N) noexcept {
  const double force_N = machine.tip_force_N.norm();
  if (!(machine.confidence > kLeastConfidence) || !std::isfinite(force_N)) return;
  const bool too_much = force_N > (told_.too_much ? kWellWithin : 1) * most_N;
  if (too_much != told_.too_much) note(now, ConsoleEventKind::kTooMuch, too_much, force_N, most_N);
  told_.too_much = too_much;
}

void EventWatch::watch_standing(Time now, const Reason& reason) noexcept {
  if (!same_cause(reason, standing_)) standing_since_ = now;
  standing_ = reason;
  if (!standing_ || same_cause(standing_, told_.reason) || now - standing_since_ < kStanding) return;
  told_.reason = standing_;
  ring_.push({.kind = ConsoleEventKind::kBlocked, .at = now, .run = run_, .reason = standing_});
}

void EventWatch::watch_operator(Time now, const Watched& side) noexcept {
  if (side.stop != told_.stop) note(now, ConsoleEventKind::kStop, side.stop);
  told_.stop = side.stop;
  const auto changed = [&](ConsoleEventKind kind, const Reason& reason, Reason& told) {
    if (!same_cause(reason, told)) ring_.push({.kind = kind, .at = now, .run = run_, .reason = told = reason});
  };
  changed(ConsoleEventKind::kDevice, side.device, told_.device);
  changed(ConsoleEventKind::kWarning, side.warning, told_.warning);
}

void EventWatch::watch_world(Time now, const sim::WorldEventRing& world) noexcept {
  if (world.count > world_read_ + sim::WorldEventRing::kCapacity)
    world_read_ = world.count - sim::WorldEventRing::kCapacity;
  for (; world_read_ < world.count; ++world_read_) {
    const sim::WorldEvent& happened = world.at(world_read_);
    // What the machine itself measures is reported as contact.
    if (happened.kind == sim::WorldEventKind::kContact || happened.kind == sim::WorldEventKind::kRelease) continue;
    ring_.push(
        {.kind = ConsoleEventKind::kPiece, .at = now, .run = run_, .piece = happened.kind, .value = happened.value});
  }
}

}  // namespace knuckle::console
