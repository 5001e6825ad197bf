#include "app/console/player/run_data.h"

#include <cmath>
#include <string_view>

#include "app/console/named_fields.h"
#include "estimation/force_estimator.h"

namespace knuckle::console::player {
namespace {

bool same(const HandStanding& a, const HandStanding& b) {
  const auto bytes = [](const HandStanding& of, const Field& field) {
    return std::string_view(reinterpret_cast<const char*>(&of.hand) + field.offset, field.size);
  };
  const std::vector<Field>& fields = fields_of<OperatorSide>();
  return a.heard == b.heard && std::all_of(fields.begin(), fields.end(),
                                           [&](const Field& field) { return bytes(a, field) == bytes(b, field); });
}

/// The message that was made of a state.
SlaveMessage message_of(const slave::SlaveState& state, std::uint32_t sequence) {
  SlaveMessage told = slave::message_of(state);
  told.stamp.sequence = sequence;
  told.stamp.sent_at = state.at;
  told.sensor_at = state.measured ? std::max(Time{}, state.at - from_seconds(state.oldest_age_s)) : kNever;
  return told;
}

}  // namespace

void RunData::add(HandStep step, HandStanding standing) {
  OperatorSide& own = standing.hand;
  step.set_point_rad = own.set_point_rad.cast<float>();
  step.sent_force_N = own.sent_force_N.cast<float>();
  step.hand_energy_J = static_cast<float>(own.hand_energy_J);
  own.set_point_rad.setConstant(double{kUnknown});
  own.sent_force_N.setConstant(double{kUnknown});
  own.hand_energy_J = double{kUnknown};
  if (standings.empty() || !same(standings.back(), standing)) standings.push_back(standing);
  step.standing = static_cast<std::uint32_t>(standings.size() - 1);
  hand.push_back(step);
}

void RunData::add(const master::MasterState& state) {
  if (!hand.empty() && state.at <= hand.back().at) return;
  HandStep step;
  step.at = state.at;
  step.round_trip_s = static_cast<float>(state.round_trip_s);
  step.silence_s = static_cast<float>(state.silence_s);
  add(step, {state.heard, console::operator_side(state, position_scale, force_scale)});
}

void RunData::add(const slave::SlaveState& state, const SlaveMessage* told) {
  if (!machine.empty() && state.at <= machine.back().at) return;
  MachineStep step;
  step.at = state.at;
  const std::uint32_t next = machine.empty() ? 0 : machine.back().told.stamp.sequence + 1;
  step.told = told != nullptr ? *told : message_of(state, next);
  // An imported table may have lengths that no joint angle gives.
  for (int joint = 0; joint < kJoints; ++joint)
    if (double& angle_rad = step.told.position_rad[joint]; !std::isfinite(angle_rad))
      angle_rad = machine.empty() ? 0 : machine.back().told.position_rad[joint];
  step.command = state.valve_command.cast<float>();
  step.spool = state.spool.cast<float>();
  step.pilot_on = state.pilot_on;
  // As the status has it: a force told with no confidence at all rests on no usable sensors.
  step.force_doubts = state.confidence > 0 ? state.confidence_reasons : std::uint16_t{estimation::kBadInput};
  machine.push_back(step);
  if (operator_side) return;
  // Of the operator's side this one knows what it has received.
  HandStep hand_step;
  hand_step.at = state.at;
  hand_step.silence_s = 0;
  HandStanding standing{.heard = true, .hand = {}};
  make_unknown(standing.hand);
  if (state.heard) {
    hand_step.round_trip_s = static_cast<float>(state.round_trip_s);
    copy_named(state, standing.hand);
    if (state.device_ok) standing.hand.device = {};
  }
  add(hand_step, standing);
}

void RunData::add(Time arrived, const SlaveMessage& message) {
  MachineStep step;
  step.at = arrived;
  step.told = message;
  machine.push_back(step);
}

LinkFeed::LinkFeed(const RunData& data, Time from)
    : data_(data),
      watch_(data.machine_period),
      arrival_(static_cast<std::size_t>(first_from(data.arrivals, from) - data.arrivals.begin())),
      status_(static_cast<std::size_t>(first_from(data.statuses, from) - data.statuses.begin())) {}

void LinkFeed::take_statuses(Time before) noexcept {
  for (; status_ < data_.statuses.size() && data_.statuses[status_].at < before; ++status_) {
    watch_.stamp(data_.statuses[status_].at);
    watch_.note(data_.statuses[status_].status);
  }
}

void LinkFeed::pass(Time at) noexcept {
  SlaveMessage message;
  for (; arrival_ < data_.arrivals.size() && data_.arrivals[arrival_].at <= at; ++arrival_) {
    const Arrival& arrival = data_.arrivals[arrival_];
    take_statuses(arrival.at);
    watch_.stamp(arrival.at);
    message.stamp.session = arrival.session;
    message.stamp.sequence = arrival.sequence;
    message.stamp.echoed = arrival.echoed;
    watch_.note(message);
  }
  take_statuses(at + 1ns);
  watch_.stamp(at);
}

}  // namespace knuckle::console::player
