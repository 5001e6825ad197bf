#include "app/console/event_watch.h"

#include <algorithm>
#include <cmath>

#include "app/console/console_view.h"
#include "app/console/machine_words.h"

namespace knuckle::console {
namespace {

constexpr Duration kStanding = 1s;
constexpr double kWellWithin = 0.9;  // of the maximum set: a force that hovers about it is told once

}  // namespace

ConsoleEvent EventWatch::event(Time now, ConsoleEventKind kind) const noexcept {
  ConsoleEvent event;
  event.kind = kind;
  event.at = now;
  event.run = run_;
  return event;
}

void EventWatch::note(Time now, ConsoleEventKind kind, bool on, double value) noexcept {
  ConsoleEvent e = event(now, kind);
  e.on = on;
  e.value = value;
  ring_.push(e);
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
    ConsoleEvent e = event(now, ConsoleEventKind::kMachine);
    e.mode = told_.mode = machine->mode;
    e.reason = told_.reason = machine->fault ? machine->fault : machine->blocking;
    told_.fault = machine->fault;
    ring_.push(e);
  }
  if (machine->contact != told_.contact) {
    ConsoleEvent e = event(now, ConsoleEventKind::kContact);
    e.on = told_.contact = machine->contact;
    e.value = machine->tip_force_N.norm();
    ring_.push(e);
  }
  watch_force(now, *machine, side.force_most_N);
  watch_standing(now, machine->blocking);
}

/// A force without confidence tells nothing, neither way.
void EventWatch::watch_force(Time now, const SlaveMessage& machine, double most_N) noexcept {
  const double force_N = machine.tip_force_N.norm();
  if (!(machine.confidence > kLeastConfidence) || !std::isfinite(force_N)) return;
  const bool too_much = force_N > (told_.too_much ? kWellWithin : 1) * most_N;
  if (too_much == told_.too_much) return;
  ConsoleEvent e = event(now, ConsoleEventKind::kTooMuch);
  e.on = told_.too_much = too_much;
  e.value = force_N;
  e.limit = most_N;
  ring_.push(e);
}

void EventWatch::watch_standing(Time now, const Reason& reason) noexcept {
  if (!same_cause(reason, standing_)) standing_since_ = now;
  standing_ = reason;
  if (!standing_ || same_cause(standing_, told_.reason) || now - standing_since_ < kStanding) return;
  told_.reason = standing_;
  ConsoleEvent e = event(now, ConsoleEventKind::kBlocked);
  e.reason = standing_;
  ring_.push(e);
}

void EventWatch::watch_operator(Time now, const Watched& side) noexcept {
  if (side.stop != told_.stop) note(now, ConsoleEventKind::kStop, side.stop);
  told_.stop = side.stop;
  const auto changed = [&](ConsoleEventKind kind, const Reason& reason, Reason& told) {
    if (same_cause(reason, told)) return;
    ConsoleEvent e = event(now, kind);
    e.reason = told = reason;
    ring_.push(e);
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
    ConsoleEvent e = event(now, ConsoleEventKind::kPiece);
    e.piece = happened.kind;
    e.value = happened.value;
    ring_.push(e);
  }
}

}  // namespace knuckle::console
