#include "slave/sensors.h"

#include <algorithm>
#include <cmath>

#include "transport/canopen.h"

namespace knuckle::slave {

SensorSet::SensorSet(const MachineDescription& machine)
    : pressure_ceiling_Pa_(machine.sensors.pressure_range_Pa * kValidity.pressure_over_range),
      tilt_min_rad_(-kValidity.hull_tilt_rad),
      tilt_max_rad_(kValidity.hull_tilt_rad),
      tilt_on_boom_(machine.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom),
      age_limit_(from_seconds(machine.bus.sensor_age_limit_s)),
      kinematics_(machine) {
  for (std::size_t i = 0; i < kPressures; ++i) channels_[i].node = machine.bus.pressures[i].id;
  for (std::size_t i = 0; i < kJoints; ++i) {
    channels_[kPressures + i].node = machine.bus.encoders[i].id;
    shortest_m_[i] = machine.cylinders[i].min_length_m - kValidity.length_margin_m;
    longest_m_[i] = machine.cylinders[i].max_length_m + kValidity.length_margin_m;
  }
  channels_[kTilt].node = machine.bus.tilt.id;
  for (std::size_t i = 0; i < kChannels; ++i) index_[channels_[i].node & 0x7FU] = static_cast<std::uint8_t>(i + 1);
  if (tilt_on_boom_) {
    tilt_min_rad_ += machine.links[kBoom].min_rad;
    tilt_max_rad_ += machine.links[kBoom].max_rad;
  }
}

void SensorSet::reset() noexcept {
  for (Channel& channel : channels_) channel = {channel.node, 0, kNever, 0, 0};
}

void SensorSet::receive(const CanFrame& frame, Time now) noexcept {
  if (frame.id > 0x7FF || canopen::function_of(frame.id) != canopen::tpdo1_id(0)) return;
  const std::uint8_t position = index_[canopen::node_of(frame.id)];
  if (position == 0) return;
  const std::size_t which = position - 1U;
  if (which < kPressures) return on_pressure(channels_[which], frame, now);
  if (which < kTilt) return on_length(which - kPressures, frame, now);
  on_tilt(channels_[which], frame, now);
}

void SensorSet::accept(Channel& channel, double value, bool possible, double shown, Time now) noexcept {
  if (possible) {
    channel.value = value;
    channel.at = now;
    channel.bad = 0;
    return;
  }
  ++rejected_;
  channel.bad = std::min(channel.bad + 1, kValidity.bad_in_a_row);
  channel.worst = shown;
}

void SensorSet::on_pressure(Channel& channel, const CanFrame& frame, Time now) noexcept {
  const auto reading = canopen::parse_pressure(frame);
  if (!reading) return accept(channel, 0, false, -1, now);
  const bool status_bad = (reading->status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0;
  const bool in_range =
      reading->pressure_Pa >= kValidity.pressure_floor_Pa && reading->pressure_Pa <= pressure_ceiling_Pa_;
  accept(channel, reading->pressure_Pa, !status_bad && in_range, status_bad ? reading->status : reading->pressure_Pa,
         now);
}

void SensorSet::on_length(std::size_t joint, const CanFrame& frame, Time now) noexcept {
  Channel& channel = channels_[kPressures + joint];
  const auto reading = canopen::parse_encoder(frame);
  if (!reading) return accept(channel, 0, false, -1, now);
  const double length = reading->position_m;
  const bool in_range = length >= shortest_m_[joint] && length <= longest_m_[joint];
  // No longer than a value may be used: with all of its age, waiting would make every jump of a slipped drum possible.
  const Duration since = std::min(now - channel.at, age_limit_);
  const double allowed = kValidity.jump_m + kValidity.cylinder_mps * to_seconds(since);
  const bool reachable = channel.at == kNever || std::abs(length - channel.value) <= allowed;
  accept(channel, length, in_range && reachable, length, now);
}

void SensorSet::on_tilt(Channel& channel, const CanFrame& frame, Time now) noexcept {
  const auto slope = canopen::parse_tilt(frame);
  if (!slope) return accept(channel, 0, false, -1, now);
  accept(channel, *slope, *slope >= tilt_min_rad_ && *slope <= tilt_max_rad_, *slope, now);
}

Reason SensorSet::fault(Time now) const noexcept {
  for (const Channel& channel : channels_) {
    if (channel.bad >= kValidity.bad_in_a_row) {
      return {ReasonCode::kSensorInvalid, channel.node, static_cast<float>(channel.worst), 0};
    }
  }
  const Channel& channel = oldest();
  const Duration age = now - channel.at;
  if (age <= age_limit_) return {};
  return {ReasonCode::kSensorStale, channel.node, static_cast<float>(to_seconds(age) * 1e3),
          static_cast<float>(to_seconds(age_limit_) * 1e3)};
}

const SensorSet::Channel& SensorSet::oldest() const noexcept {
  return *std::min_element(channels_.begin(), channels_.end(),
                           [](const Channel& a, const Channel& b) { return a.at < b.at; });
}

Time SensorSet::oldest_at() const noexcept {
  return oldest().at;
}
std::uint8_t SensorSet::oldest_node() const noexcept {
  return oldest().node;
}

Time SensorSet::newest_at() const noexcept {
  return std::max_element(channels_.begin(), channels_.end(),
                          [](const Channel& a, const Channel& b) { return a.at < b.at; })
      ->at;
}

std::optional<estimation::Measurement> SensorSet::measurement() const noexcept {
  if (oldest_at() == kNever) return std::nullopt;
  estimation::Measurement m;
  for (std::size_t i = 0; i < kPressures; ++i) m.pressure_Pa[i] = channels_[i].value;
  for (int i = 0; i < kJoints; ++i) m.cylinder_m[i] = channels_[kPressures + static_cast<std::size_t>(i)].value;
  m.hull_pitch_rad = channels_[kTilt].value;
  if (tilt_on_boom_) {
    const auto boom_rad = kinematics_.joint_at(kBoom, m.cylinder_m[kBoom]);
    if (!boom_rad) return std::nullopt;
    m.hull_pitch_rad -= *boom_rad;
  }
  return m;
}

}  // namespace knuckle::slave
