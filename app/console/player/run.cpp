#include "app/console/player/run.h"

#include <algorithm>
#include <cmath>

#include "app/console/player/link_feed.h"
#include "app/console/player/rows.h"
#include "estimation/force_estimator.h"
#include "slave/loss_policy.h"

namespace knuckle::console::player {
namespace {

constexpr Duration kGap = 100ms;            // many steps of either loop
constexpr Duration kSilent = 250ms;         // of the link: from then on the console shows nothing of the machine as new
constexpr Duration kLinkWindow = 11s;       // what LinkWatch looks back, and a little
constexpr Time kStamped = Time(24h * 400);  // any time that is later than every age of a sensor

template <std::size_t kSize, typename Vector>
std::array<float, kSize> floats(const Vector& v) {
  std::array<float, kSize> all{};
  for (std::size_t i = 0; i < kSize; ++i) all[i] = static_cast<float>(v.data()[i]);
  return all;
}
JointVector joints(const std::array<float, 3>& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

bool same(const Reason& a, const Reason& b) {
  return same_cause(a, b) && a.value == b.value && a.limit == b.limit;
}
bool same_number(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}
bool same(const HandStanding& a, const HandStanding& b) {
  return a.heard == b.heard && a.presence == b.presence && a.enable == b.enable && a.clutch == b.clutch &&
         a.stop == b.stop && same(a.device, b.device) && same(a.warning, b.warning) &&
         same_number(a.position_scale, b.position_scale) && same_number(a.force_scale, b.force_scale) &&
         a.assist.force_limit_N == b.assist.force_limit_N && a.assist.stop_on_object == b.assist.stop_on_object;
}

/// A scale of 0 was never chosen.
double chosen(double scale, double otherwise) {
  return scale > 0 ? scale : otherwise;
}

void put(const SlaveMessage& told, MachineStep& step) {
  step.sequence = told.stamp.sequence;
  if (told.sensor_at != kNever)
    step.sensor_age_s = static_cast<float>(std::max(0.0, to_seconds(told.stamp.sent_at - told.sensor_at)));
  step.blocking = told.blocking;
  step.fault = told.fault;
  step.limits = told.limits;
  step.mode = told.mode;
  step.contact = told.contact;
  step.confidence = static_cast<float>(told.confidence);
  step.joint_rad = floats<3>(told.position_rad);
  step.joint_radps = floats<3>(told.velocity_radps);
  step.tip_force_N = floats<2>(told.tip_force_N);
  step.covariance_N2 = floats<3>(told.covariance_N2);
  step.pressure_Pa = floats<6>(told.pressure_Pa);
  step.payload_kg = static_cast<float>(told.payload_kg);
  step.payload_sigma_kg = static_cast<float>(told.payload_sigma_kg);
}

/// In which no number is one but the machine's pose, for the picture.
ConsoleView unknown_view() {
  constexpr auto kNothing = static_cast<double>(kUnknown);
  ConsoleView v;
  v.machine.sensor_at = kNever;
  v.machine.velocity_radps.setConstant(kNothing);
  v.machine.tip_force_N.setConstant(kNothing);
  v.machine.covariance_N2.fill(kNothing);
  v.machine.pressure_Pa.fill(kNothing);
  v.machine.confidence = v.machine.payload_kg = v.machine.payload_sigma_kg = kNothing;
  v.status.valve_command.setConstant(kNothing);
  v.status.spool.setConstant(kNothing);
  v.status.oil_flow_m3ps = v.status.hydraulic_power_W = kNothing;
  v.hand.ghost_rad.setConstant(kNothing);  // the hand's own request is not recorded
  v.hand.set_point_rad.setConstant(kNothing);
  v.hand.sent_force_N.setConstant(kNothing);
  v.hand.position_scale = v.hand.force_scale = v.hand.hand_energy_J = kNothing;
  v.link.round_trip_s = v.link.loss = v.link.neutral_after_s = kNothing;
  return v;
}

/// What a state knows of the message that was made of it.
SlaveMessage message_of(const slave::SlaveState& state, std::uint32_t sequence) {
  SlaveMessage told;
  told.stamp.sequence = sequence;
  told.stamp.sent_at = state.at;
  told.sensor_at = state.measured ? state.at - from_seconds(state.oldest_age_s) : kNever;
  told.mode = state.mode;
  told.blocking = state.blocking;
  told.fault = state.fault;
  told.limits = state.limits;
  told.contact = state.contact;
  told.confidence = state.confidence;
  told.position_rad = state.joint_rad;
  told.velocity_radps = state.joint_radps;
  told.tip_force_N = state.tip_force_N;
  told.covariance_N2 = state.covariance_N2;
  told.pressure_Pa = state.pressure_Pa;
  told.payload_kg = state.payload_kg;
  told.payload_sigma_kg = state.payload_sigma_kg;
  return told;
}

}  // namespace

void RunData::add(HandStep step, const HandStanding& standing) {
  if (standings.empty() || !same(standings.back(), standing)) standings.push_back(standing);
  step.standing = static_cast<std::uint32_t>(standings.size() - 1);
  hand.push_back(step);
}

void RunData::add(const master::MasterState& state) {
  if (!hand.empty() && state.at <= hand.back().at) return;
  HandStep step;
  step.at = state.at;
  step.set_point_rad = floats<3>(state.setpoint_rad);
  step.sent_force_N = floats<2>(state.sent_force_N);
  step.hand_energy_J = static_cast<float>(state.energy_out_J - state.energy_in_J);
  step.round_trip_s = static_cast<float>(state.round_trip_s);
  step.silence_s = static_cast<float>(state.silence_s);
  add(step, {.heard = state.heard,
             .presence = state.presence,
             .enable = state.enable,
             .clutch = state.clutch,
             .stop = state.stop,
             .device = state.other_machine ? state.other_machine : state.device,
             .warning = state.warning,
             .position_scale = chosen(state.settings.position_scale, position_scale),
             .force_scale = chosen(state.settings.force_scale, force_scale),
             .assist = state.settings.assist});
}

void RunData::add(const slave::SlaveState& state, const SlaveMessage* told) {
  if (!machine.empty() && state.at <= machine.back().at) return;
  MachineStep step;
  step.at = state.at;
  const std::uint32_t next = machine.empty() ? 0 : machine.back().sequence + 1;
  put(told != nullptr ? *told : message_of(state, next), step);
  // An imported table may have lengths that no joint angle gives.
  for (std::size_t j = 0; j < step.joint_rad.size(); ++j)
    if (!std::isfinite(step.joint_rad[j])) step.joint_rad[j] = machine.empty() ? 0 : machine.back().joint_rad[j];
  step.command = floats<3>(state.valve_command);
  step.spool = floats<3>(state.spool);
  step.pilot_on = state.pilot_on;
  // As the status has it: a force told with no confidence at all rests on no usable sensors.
  step.force_doubts = state.confidence > 0 ? state.confidence_reasons : std::uint8_t{estimation::kBadInput};
  machine.push_back(step);
  if (operator_side) return;
  // Of the operator's side this one knows what it has received.
  HandStep hand_step;
  hand_step.at = state.at;
  if (state.heard) hand_step.set_point_rad = floats<3>(state.setpoint_rad);
  hand_step.round_trip_s = state.heard ? static_cast<float>(state.round_trip_s) : kUnknown;
  hand_step.silence_s = 0;
  HandStanding standing;
  standing.heard = true;
  if (state.heard) {
    standing.presence = state.presence;
    standing.enable = state.enable;
    standing.clutch = state.clutch;
    standing.stop = state.stop;
    if (!state.device_ok) standing.device = state.device;
    standing.assist = {state.assist_force_limit_N, state.assist_stop_on_object};
  }
  add(hand_step, standing);
}

void RunData::add(Time arrived, const SlaveMessage& message) {
  MachineStep step;
  step.at = arrived;
  put(message, step);
  machine.push_back(step);
}

SlaveMessage message_of(const MachineStep& step) {
  SlaveMessage told;
  told.stamp.sequence = step.sequence;
  told.stamp.sent_at = kStamped;
  told.sensor_at =
      std::isnan(step.sensor_age_s) ? kNever : kStamped - from_seconds(static_cast<double>(step.sensor_age_s));
  told.blocking = step.blocking;
  told.fault = step.fault;
  told.limits = step.limits;
  told.mode = step.mode;
  told.contact = step.contact;
  told.confidence = static_cast<double>(step.confidence);
  told.position_rad = joints(step.joint_rad);
  told.velocity_radps = joints(step.joint_radps);
  told.tip_force_N = {static_cast<double>(step.tip_force_N[0]), static_cast<double>(step.tip_force_N[1])};
  std::copy(step.covariance_N2.begin(), step.covariance_N2.end(), told.covariance_N2.begin());
  std::copy(step.pressure_Pa.begin(), step.pressure_Pa.end(), told.pressure_Pa.begin());
  told.payload_kg = static_cast<double>(step.payload_kg);
  told.payload_sigma_kg = static_cast<double>(step.payload_sigma_kg);
  return told;
}

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
        return step != nullptr && step->sequence == candidate.sequence;
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
    for (const MachineStep& step : data_.machine) note(step.at, step.mode);
  } else {
    for (const Receipt& receipt : data_.receipts)
      if (const MachineStep* step = machine_at(receipt.at)) note(receipt.at, step->mode);
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
  const auto later =
      std::upper_bound(data_.machine.begin(), data_.machine.end(), receipt->sequence,
                       [](std::uint32_t sequence, const MachineStep& step) { return newer(step.sequence, sequence); });
  if (later == data_.machine.begin()) return nullptr;
  const MachineStep& step = *std::prev(later);
  return (receipt->sequence - step.sequence) * data_.machine_period <= kGap ? &step : nullptr;
}

const HandStep* Run::hand_at(Time at) const noexcept {
  return newest(data_.hand, at);
}

ConsoleView Run::view(Time at) const {
  ConsoleView v = unknown_view();
  v.now = at;
  v.sensors_alone = data_.sensors_alone;
  const Gap* const gap = gap_at(at);
  const MachineStep* const machine = machine_at(gap != nullptr ? gap->from : at);
  // In holes of a table its samples hold the values before them.
  const bool held = machine != nullptr && data_.sensors_alone && std::isnan(machine->sensor_age_s);
  if (machine != nullptr && gap == nullptr && !held)
    v.machine = message_of(*machine);
  else if (machine != nullptr)
    v.machine.position_rad = joints(machine->joint_rad);
  if (gap != nullptr) return v;
  if (data_.operator_side) v.link.neutral_after_s = to_seconds(slave::kLossLimits.neutral);
  if (const HandStep* step = hand_at(at)) {
    const HandStanding& standing = data_.standings[step->standing];
    v.hand.device = standing.device;
    v.hand.presence = standing.presence;
    v.hand.enable = standing.enable;
    v.hand.clutch = standing.clutch;
    v.hand.stop = standing.stop;
    v.hand.warning = standing.warning;
    v.hand.position_scale = standing.position_scale;
    v.hand.force_scale = standing.force_scale;
    v.hand.assist = standing.assist;
    v.hand.set_point_rad = joints(step->set_point_rad);
    v.hand.sent_force_N = {static_cast<double>(step->sent_force_N[0]), static_cast<double>(step->sent_force_N[1])};
    v.hand.hand_energy_J = static_cast<double>(step->hand_energy_J);
    v.link.heard = standing.heard;
    v.link.silence_s = static_cast<double>(step->silence_s) + to_seconds(at - step->at);
    v.link.round_trip_s = static_cast<double>(step->round_trip_s);
  }
  v.link.heard = v.link.heard && machine != nullptr;
  const StatusRow* row = newest(data_.statuses, at);
  v.status_heard = row != nullptr;
  if (row != nullptr) {
    v.status = row->status;
    v.status_age_s = to_seconds(at - row->at);
  }
  v.status_of_steps = machine != nullptr && !std::isnan(machine->command[0]);
  if (!v.status_of_steps) return v;
  v.status.valve_command = joints(machine->command);
  v.status.spool = joints(machine->spool);
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

}  // namespace knuckle::console::player
