#include "app/console/player/run.h"

#include <algorithm>
#include <cmath>

#include "app/console/link_watch.h"
#include "estimation/force_estimator.h"
#include "slave/loss_policy.h"

namespace knuckle::console::player {
namespace {

constexpr Duration kGap = 100ms;            // many steps of either loop
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

/// Of rows in the order of their times, the last one that is not later; nullptr: there is none.
template <typename Row>
const Row* newest(const std::vector<Row>& rows, Time at) noexcept {
  const auto later = std::upper_bound(rows.begin(), rows.end(), at, [](Time t, const Row& row) { return t < row.at; });
  return later == rows.begin() ? nullptr : &*std::prev(later);
}
template <typename Row>
std::optional<Time> after(const std::vector<Row>& rows, Time at) noexcept {
  const auto later = std::upper_bound(rows.begin(), rows.end(), at, [](Time t, const Row& row) { return t < row.at; });
  return later == rows.end() ? std::nullopt : std::optional(later->at);
}
template <typename Row>
std::optional<Time> before(const std::vector<Row>& rows, Time at) noexcept {
  const auto not_before =
      std::lower_bound(rows.begin(), rows.end(), at, [](const Row& row, Time t) { return row.at < t; });
  return not_before == rows.begin() ? std::nullopt : std::optional(std::prev(not_before)->at);
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
  const auto holds = [at](const Gap& gap) { return gap.from < at && at < gap.to; };
  return at >= first_ && at <= last_ && std::none_of(gaps_.begin(), gaps_.end(), holds);
}

void Run::find_gaps() {
  // Both loops' records go through one file: where one is missing, the other one tells on.
  Time newest_step = first_;
  for (auto at = step_after(first_ - 1ns); at; at = step_after(*at)) {
    if (*at - newest_step > kGap) gaps_.push_back({newest_step, *at});
    newest_step = *at;
  }
}

void Run::find_modes() {
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

const MachineStep* Run::machine_at(Time at) const noexcept {
  if (!data_.operator_side || !data_.machine_side) return newest(data_.machine, at);
  const Receipt* receipt = newest(data_.receipts, at);
  if (receipt == nullptr) return nullptr;
  // Sequences grow by one a step, and are not lost where steps of the recording are.
  const auto found =
      std::lower_bound(data_.machine.begin(), data_.machine.end(), receipt->sequence,
                       [](const MachineStep& step, std::uint32_t sequence) { return newer(sequence, step.sequence); });
  return found == data_.machine.end() || found->sequence != receipt->sequence ? nullptr : &*found;
}

const HandStep* Run::hand_at(Time at) const noexcept {
  return newest(data_.hand, at);
}

ConsoleView Run::view(Time at) const {
  ConsoleView v;
  v.now = at;
  v.hand.ghost_rad.setConstant(static_cast<double>(kUnknown));  // the hand's own request is not recorded
  v.hand.set_point_rad.setConstant(static_cast<double>(kUnknown));
  v.hand.sent_force_N.setConstant(static_cast<double>(kUnknown));
  v.hand.position_scale = v.hand.force_scale = v.hand.hand_energy_J = static_cast<double>(kUnknown);
  v.link.round_trip_s = v.link.loss = static_cast<double>(kUnknown);
  v.link.neutral_after_s = data_.operator_side ? to_seconds(slave::kLossLimits.neutral) : static_cast<double>(kUnknown);
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
  const MachineStep* machine = machine_at(at);
  v.link.heard = v.link.heard && machine != nullptr;
  if (machine != nullptr) v.machine = message_of(*machine);
  const StatusRow* row = newest(data_.statuses, at);
  v.status_heard = row != nullptr;
  if (row != nullptr) {
    v.status = row->status;
    v.status_age_s = to_seconds(at - row->at);
  } else {
    v.status.oil_flow_m3ps = v.status.hydraulic_power_W = static_cast<double>(kUnknown);
  }
  v.status_of_steps = machine != nullptr && !std::isnan(machine->command[0]);
  if (!v.status_of_steps) return v;
  v.status.valve_command = joints(machine->command);
  v.status.spool = joints(machine->spool);
  v.status.pilot_on = machine->pilot_on;
  v.status.force_doubts = machine->force_doubts;
  return v;
}

void Run::show_link(Time at, LinkSide& link) const {
  if (!data_.operator_side || data_.arrivals.empty()) return;
  LinkWatch watch(data_.machine_period);
  const auto from = [&](const auto& rows) {
    return std::lower_bound(rows.begin(), rows.end(), at - kLinkWindow,
                            [](const auto& row, Time t) { return row.at < t; });
  };
  auto status = from(data_.statuses);
  SlaveMessage message;
  for (auto arrival = from(data_.arrivals); arrival != data_.arrivals.end() && arrival->at <= at; ++arrival) {
    for (; status != data_.statuses.end() && status->at < arrival->at; ++status) {
      watch.stamp(status->at);
      watch.note(status->status);
    }
    watch.stamp(arrival->at);
    message.stamp.session = arrival->session;
    message.stamp.sequence = arrival->sequence;
    message.stamp.echoed = arrival->echoed;
    watch.note(message);
  }
  for (; status != data_.statuses.end() && status->at <= at; ++status) {
    watch.stamp(status->at);
    watch.note(status->status);
  }
  watch.stamp(at);
  link.round_trip = watch.round_trip();
  link.arrival_jitter = watch.arrival_jitter();
  link.hand_to_valve = watch.hand_to_valve();
  link.loss = watch.loss();
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
