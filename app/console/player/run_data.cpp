#include "app/console/player/run_data.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "estimation/force_estimator.h"

namespace knuckle::console::player {
namespace {

constexpr Time kStamped = Time(24h * 400);  // any time that is later than every age of a sensor

template <std::size_t kSize, typename Vector>
std::array<float, kSize> floats(const Vector& v) {
  std::array<float, kSize> all{};
  for (std::size_t i = 0; i < kSize; ++i) all[i] = static_cast<float>(v.data()[i]);
  return all;
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

/// Numbers as the other side holds them, one by one.
template <typename From, typename To>
void copy(const From& from, To& to) {
  if constexpr (std::is_same_v<From, To>)
    to = from;
  else if constexpr (std::is_arithmetic_v<From>)
    to = static_cast<To>(from);
  else
    for (std::size_t i = 0; i < static_cast<std::size_t>(from.size()); ++i) copy(from.data()[i], to.data()[i]);
}

/// What a row holds of a message, besides the age of its sensors: said once for both ways.
template <typename Step, typename Message, typename Each>
void each_held(Step& step, Message& told, Each each) {
  each(step.sequence, told.stamp.sequence);
  each(step.blocking, told.blocking);
  each(step.fault, told.fault);
  each(step.limits, told.limits);
  each(step.mode, told.mode);
  each(step.contact, told.contact);
  each(step.confidence, told.confidence);
  each(step.joint_rad, told.position_rad);
  each(step.joint_radps, told.velocity_radps);
  each(step.tip_force_N, told.tip_force_N);
  each(step.covariance_N2, told.covariance_N2);
  each(step.pressure_Pa, told.pressure_Pa);
  each(step.payload_kg, told.payload_kg);
  each(step.payload_sigma_kg, told.payload_sigma_kg);
}

void put(const SlaveMessage& told, MachineStep& step) {
  each_held(step, told, [](auto& held, const auto& value) { copy(value, held); });
  if (told.sensor_at != kNever)
    step.sensor_age_s = static_cast<float>(std::max(0.0, to_seconds(told.stamp.sent_at - told.sensor_at)));
}

/// What a state knows of the message that was made of it.
SlaveMessage message_of(const slave::SlaveState& state, std::uint32_t sequence) {
  SlaveMessage told = slave::message_of(state);
  told.stamp.sequence = sequence;
  told.stamp.sent_at = state.at;
  told.sensor_at = state.measured ? state.at - from_seconds(state.oldest_age_s) : kNever;
  return told;
}

}  // namespace

JointVector joints(const std::array<float, 3>& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

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
  each_held(step, told, [](const auto& held, auto& value) { copy(held, value); });
  told.stamp.sent_at = kStamped;
  told.sensor_at =
      std::isnan(step.sensor_age_s) ? kNever : kStamped - from_seconds(static_cast<double>(step.sensor_age_s));
  return told;
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

void LinkFeed::show(LinkSide& link) const noexcept {
  link.round_trip = watch_.round_trip();
  link.arrival_jitter = watch_.arrival_jitter();
  link.hand_to_valve = watch_.hand_to_valve();
  link.loss = watch_.loss();
}

}  // namespace knuckle::console::player
