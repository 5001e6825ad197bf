#include "app/console/player/run.h"

#include <cmath>
#include <iterator>
#include <utility>

#include "app/console/named_fields.h"
#include "slave/loss_policy.h"

namespace knuckle::console::player {
namespace {

constexpr Duration kGap = 100ms;       // many steps of either loop
constexpr Duration kSilent = 250ms;    // of the link: from then on the console shows nothing of the machine as new
constexpr Duration kLinkWindow = 11s;  // what LinkWatch looks back, and a little

/// In which no number is one but the machine's pose, for the picture.
ConsoleView unknown_view() {
  ConsoleView v;
  make_unknown(v.machine);
  make_unknown(v.status);
  make_unknown(v.hand);
  v.machine.position_rad.setZero();
  v.machine.sensor_at = kNever;
  v.link.round_trip_s = v.link.loss = v.link.neutral_after_s = double{kUnknown};
  return v;
}

}  // namespace

Run::Run(RunData data) : data_(std::move(data)) {
  data_.hand.shrink_to_fit();  // what is held for as long as it is played
  data_.machine.shrink_to_fit();
  data_.receipts.shrink_to_fit();
  data_.arrivals.shrink_to_fit();
  data_.statuses.shrink_to_fit();
  if (empty()) return;
  const auto& hand = data_.hand;
  const auto& machine = data_.machine;
  first_ = hand.empty() ? machine.front().at : hand.front().at;
  last_ = hand.empty() ? machine.back().at : hand.back().at;
  if (data_.machine_side) {
    first_ = std::min(first_, machine.front().at);
    last_ = std::max(last_, machine.back().at);
  }
  find_gaps();
  find_modes();
}

bool Run::recorded(Time at) const noexcept {
  return at >= first_ && at <= last_ && gap_at(at) == nullptr;
}

const Gap* Run::gap_at(Time at) const noexcept {
  const auto gap = std::lower_bound(gaps_.begin(), gaps_.end(), at, [](const Gap& g, Time t) { return g.to <= t; });
  return gap != gaps_.end() && gap->from < at ? &*gap : nullptr;
}

void Run::find_gaps() {
  std::vector<Gap> found;
  for (const auto* holes : {&data_.operator_holes, &data_.machine_holes}) {
    for (const Gap& hole : *holes)
      if (hole.to - hole.from > kGap) found.push_back({hole.from, known_again(hole.to)});
  }
  std::sort(found.begin(), found.end(), [](const Gap& a, const Gap& b) { return a.from < b.from; });
  for (const Gap& gap : found) {
    if (gaps_.empty() || gap.from > gaps_.back().to)
      gaps_.push_back(gap);
    else
      gaps_.back().to = std::max(gaps_.back().to, gap.to);
  }
}

/// Messages that were under way in a hole are those of steps that are missing: the machine is known again with the
/// first message behind it whose step is recorded. A link that falls silent before that is no part of the hole.
Time Run::known_again(Time hole_end) const noexcept {
  if (data_.receipts.empty()) return hole_end;
  const auto receipt =
      std::find_if(first_from(data_.receipts, hole_end), data_.receipts.end(), [this](const Receipt& candidate) {
        const MachineStep* const step = machine_at(candidate.at);
        return step != nullptr && step->told.stamp.sequence == candidate.sequence;
      });
  const Time known = receipt == data_.receipts.end() ? last_ : receipt->at;
  const auto silent =
      std::find_if(first_from(data_.hand, hole_end), first_from(data_.hand, known),
                   [](const HandStep& step) { return static_cast<double>(step.silence_s) >= to_seconds(kSilent); });
  return silent == data_.hand.end() ? known : std::min(known, silent->at);
}

void Run::find_modes() {
  if (data_.sensors_alone) return;
  const auto note = [this](Time at, Mode mode) {
    if (modes_.empty() || modes_.back().mode != mode) modes_.push_back({at, mode});
  };
  if (data_.receipts.empty()) {
    for (const MachineStep& step : data_.machine) note(step.at, step.told.mode);
  } else {
    for (const Receipt& receipt : data_.receipts)
      if (const MachineStep* step = machine_at(receipt.at)) note(receipt.at, step->told.mode);
  }
}

bool Run::gap_between(Time earlier, Time later) const noexcept {
  const auto gap = std::lower_bound(gaps_.begin(), gaps_.end(), later, [](const Gap& g, Time t) { return g.to <= t; });
  return gap != gaps_.begin() && earlier < std::prev(gap)->to;
}

const MachineStep* Run::machine_at(Time at) const noexcept {
  if (!data_.operator_side || !data_.machine_side) {
    const MachineStep* const step = newest(data_.machine, at);
    return step == nullptr || gap_between(step->at, at) ? nullptr : step;
  }
  const Receipt* receipt = newest(data_.receipts, at);
  if (receipt == nullptr || gap_between(receipt->at, at)) return nullptr;
  // Sequences grow by one a step, and are not lost where steps of the recording are.
  const auto later = std::upper_bound(
      data_.machine.begin(), data_.machine.end(), receipt->sequence,
      [](std::uint32_t sequence, const MachineStep& step) { return newer(step.told.stamp.sequence, sequence); });
  if (later == data_.machine.begin()) return nullptr;
  const MachineStep& step = *std::prev(later);
  return (receipt->sequence - step.told.stamp.sequence) * data_.machine_period <= kGap ? &step : nullptr;
}

Time Run::first_heard() const noexcept {
  const auto heard = [this](const HandStep& step) {
    return data_.standings[step.standing].heard && machine_at(step.at) != nullptr;
  };
  const auto step = std::find_if(data_.hand.begin(), data_.hand.end(), heard);
  return step == data_.hand.end() ? first_ : step->at;
}

ConsoleView Run::view(Time at) const {
  ConsoleView v = unknown_view();
  v.now = at;
  v.sensors_alone = data_.sensors_alone;
  const Gap* const gap = gap_at(at);
  const MachineStep* const machine = machine_at(gap != nullptr ? gap->from : at);
  // In holes of a table its samples hold the values before them.
  const bool held = machine != nullptr && data_.sensors_alone && machine->told.sensor_at == kNever;
  if (machine != nullptr && gap == nullptr && !held)
    v.machine = machine->told;
  else if (machine != nullptr)
    v.machine.position_rad = machine->told.position_rad;
  if (gap != nullptr) return v;
  if (data_.operator_side) v.link.neutral_after_s = to_seconds(slave::kLossLimits.neutral);
  if (const HandStep* step = newest(data_.hand, at)) {
    const HandStanding& standing = data_.standings[step->standing];
    v.hand = standing.hand;
    v.hand.set_point_rad = step->set_point_rad.cast<double>();
    v.hand.sent_force_N = step->sent_force_N.cast<double>();
    v.hand.hand_energy_J = double{step->hand_energy_J};
    v.link.heard = standing.heard;
    v.link.silence_s = static_cast<double>(step->silence_s) + to_seconds(at - step->at);
    v.link.round_trip_s = static_cast<double>(step->round_trip_s);
  }
  v.link.heard = v.link.heard && machine != nullptr;
  const StatusRow* row = newest(data_.statuses, at);
  v.status_heard = row != nullptr;
  if (row != nullptr) {
    v.status = row->status;
    v.readings = row->readings;
    v.status_age_s = to_seconds(at - row->at);
  }
  v.status_of_steps = machine != nullptr && !std::isnan(machine->command[0]);
  if (!v.status_of_steps) return v;
  v.status.valve_command = machine->command.cast<double>();
  v.status.spool = machine->spool.cast<double>();
  v.status.pilot_on = machine->pilot_on;
  v.status.force_doubts = machine->force_doubts;
  return v;
}

std::optional<Time> Run::counted_from(Time at) const noexcept {
  const Arrival* const last = newest(data_.arrivals, at);
  if (!data_.operator_side || last == nullptr || !recorded(at)) return std::nullopt;
  const auto later = std::upper_bound(data_.operator_holes.begin(), data_.operator_holes.end(), at,
                                      [](Time t, const Gap& hole) { return t < hole.to; });
  const Time from = later == data_.operator_holes.begin() ? first_ : std::prev(later)->to;
  return from <= last->at ? std::optional(from) : std::nullopt;
}

void Run::show_link(Time at, LinkSide& link) const {
  const std::optional<Time> from = counted_from(at);
  if (!from) return;
  // In a longer silence the newest message is older, and what is due counts from it.
  LinkFeed feed(data_, std::max(*from, std::min(at - kLinkWindow, newest(data_.arrivals, at)->at)));
  feed.pass(at);
  feed.show(link);
}

std::optional<Time> Run::step_after(Time at) const noexcept {
  const auto hand = after(data_.hand, at);
  const auto machine = data_.machine_side ? after(data_.machine, at) : std::nullopt;
  return hand && machine ? std::min(hand, machine) : hand ? hand : machine;
}

std::optional<Time> Run::step_before(Time at) const noexcept {
  const auto hand = before(data_.hand, at);
  const auto machine = data_.machine_side ? before(data_.machine, at) : std::nullopt;
  return hand && machine ? std::max(hand, machine) : hand ? hand : machine;
}

double Timeline::share(Time at) const noexcept {
  const Duration whole = run_.last() - run_.first();
  return whole > Duration::zero() ? to_seconds(at - run_.first()) / to_seconds(whole) : 0;
}

Time Timeline::at_share(double share) const noexcept {
  return run_.first() + from_seconds(std::clamp(share, 0.0, 1.0) * to_seconds(run_.last() - run_.first()));
}

void Timeline::pass(double seconds) noexcept {
  if (!playing_) return;
  const Time to = cursor_ + from_seconds(seconds * speed());
  seek(to);
  playing_ = to < run_.last();
}

void Timeline::toggle() noexcept {
  if (!playing_ && cursor_ >= run_.last()) cursor_ = run_.first();
  playing_ = !playing_;
}

void Timeline::seek(Time to) noexcept {
  cursor_ = std::clamp(to, run_.first(), run_.last());
  playing_ = false;
}

void Timeline::step(bool forth) noexcept {
  const auto to = forth ? run_.step_after(cursor_) : run_.step_before(cursor_);
  seek(to.value_or(cursor_));
}

void Timeline::jump(bool forth) noexcept {
  playing_ = false;
  const auto later = [](Time at, const EventRow& row) { return at < row.at; };
  const auto earlier = [](const EventRow& row, Time at) { return row.at < at; };
  if (forth) {
    const auto next = std::upper_bound(events_.begin(), events_.end(), cursor_, later);
    if (next != events_.end()) seek(next->at);
  } else {
    const auto here = std::lower_bound(events_.begin(), events_.end(), cursor_, earlier);
    if (here != events_.begin()) seek(std::prev(here)->at);
  }
}

}  // namespace knuckle::console::player
