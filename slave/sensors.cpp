#include "slave/sensors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/frame_words.h"
#include "machine/description.h"
#include "machine/reason_text.h"
#include "transport/canopen.h"
#include "transport/signal_codec.h"

namespace knuckle::slave {

namespace {

/// As many of its bytes as a field can need.
CanFrame part_of(std::uint32_t id, std::span<const std::uint8_t> data, std::size_t from) noexcept {
  CanFrame part{.id = id, .size = 0, .data = {}};
  const auto rest = data.subspan(std::min(from, data.size()));
  part.size = static_cast<std::uint8_t>(std::min(rest.size(), part.data.size()));
  std::copy_n(rest.begin(), part.size, part.data.begin());
  return part;
}

}  // namespace

std::size_t sensor_place(const NodeChannel& channel) noexcept {
  const auto index = static_cast<std::size_t>(channel.info().index);
  const NodeRole role = channel.info().role;
  if (role == NodeRole::kPressure) return index;
  if (role == NodeRole::kEncoder) return kSensorPressures + index;
  if (role == NodeRole::kTilt) return kSensorPressures + kJoints;
  if (is_status(channel.info())) return kStatusPlace + index - kEStopClosedIndex;
  if (role == NodeRole::kReading) return kReadingsPlace + index;
  return role == NodeRole::kPilot ? kPilotsPlace + index : kSensorPlaces;
}

Duration tilt_extra_age(const MachineDescription& machine) noexcept {
  return from_seconds((machine.bus.tilt_every_nth_sync - 1) / machine.bus.sync_Hz);
}

SensorSet::SensorSet(const MachineDescription& machine)
    : closed_(machine.bus),
      encoder_offset_m_(machine.sensors.encoder_offset_m),
      jump_m_((kValidity.jump_steps * length_steps_m(machine)).cwiseMax(kValidity.jump_m)),
      pressure_ceiling_Pa_(machine.sensors.pressure_range_Pa * kValidity.pressure_over_range),
      tilt_on_boom_(machine.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom),
      age_limit_(from_seconds(machine.bus.sensor_age_limit_s)),
      tilt_age_limit_(age_limit_ + tilt_extra_age(machine)),
      kinematics_(machine),
      lengths_(machine) {
  if (const int without = machine.sensors.without_pressures; without != SensorDescription::kNone)
    pressures_count_[static_cast<std::size_t>(without)] = false;
  for (std::size_t i = 0; i < kJoints; ++i) {
    shortest_m_[i] = machine.cylinders[i].min_length_m - kValidity.length_margin_m;
    longest_m_[i] = machine.cylinders[i].max_length_m + kValidity.length_margin_m;
  }
  for (const BusFrame& frame : bus_frames(machine.bus, machine.sensors)) {
    for (const FrameField& field : frame.fields) {
      const std::size_t which = sensor_place(field.channel);
      if (which == kSensorPlaces) continue;
      Channel& channel = channels_[which];
      channel.node = machine.bus.nodes[frame.node].id;
      channel.subject = subject_of(field.channel.info().role, field.channel.info().index, machine.bus);
      channel.frame_id = frame.id;
      channel.mapped = frame.bytes();
      if (field.part == FrameField::Part::kValue) channel.field = {.signal = field.channel.signal, .bits = field.bits};
      if (field.part == FrameField::Part::kStatus) channel.status = field.bits;
    }
  }
  add_broadcasts(machine.bus);
  unheard_ = channels_;
}

void SensorSet::add_broadcasts(const BusDescription& bus) {
  for (const BroadcastFrame& frame : bus.broadcasts) {
    for (const BroadcastField& field : frame.fields) {
      const bool pilot = field.info().role == NodeRole::kPilot;
      channels_[sensor_place({.signal = field.signal})] = {
          .node = frame.module,
          .subject = signal_subject(field.signal),
          .frame_id = frame.id,
          .multiplexer = frame.multiplexer,
          .mapped = frame.bytes,
          .field = field,
          .age_limit = pilot ? age_limit_ : from_seconds(kStatusPeriods * frame.period_s)};
    }
  }
}

void SensorSet::restart() noexcept {
  const std::array<Channel, kChannels> before = std::exchange(channels_, unheard_);
  for (std::size_t i = kPressures; i < kTilt; ++i) {
    // As old as it is, so it is stale until a new one has been held against it.
    channels_[i].value = before[i].value;
    channels_[i].at = before[i].at;
  }
  shaken_ = 0;
}

void SensorSet::receive(std::uint32_t id, std::span<const std::uint8_t> data, Time now) noexcept {
  const CanFrame frame = part_of(id, data, 0);
  const FrameFault closed = closed_.fault(frame);
  for (std::size_t which = 0; which < kChannels; ++which) {
    Channel& channel = channels_[which];
    if (!counts(which) || channel.frame_id != id) continue;
    if (channel.multiplexer && read_raw(channel.multiplexer->bits, frame) != channel.multiplexer->value) continue;
    if (closed != FrameFault::kNone)
      refuse_void(channel, closed == FrameFault::kCounterRepeated ? kCounterStands : kChecksumWrong);
    else if (data.size() < channel.mapped)
      refuse_short(channel, data.size());
    else
      take(which, channel.field.first_byte == 0 ? frame : part_of(id, data, channel.field.first_byte), now);
  }
}

void SensorSet::take(std::size_t which, const CanFrame& frame, Time now) noexcept {
  Channel& channel = channels_[which];
  const BroadcastField& field = channel.field;
  const std::uint64_t raw = read_raw(field.bits, frame).value_or(0);  // a frame is long enough
  const double value = value_of(field.bits, raw);
  if (!field.value(raw)) return accept(channel, 0, false, field.analog ? value : static_cast<double>(raw), now);
  if (which < kPressures) {
    const auto status = channel.status ? read_raw(*channel.status, frame) : std::nullopt;
    return on_pressure(channel, value, static_cast<unsigned>(status.value_or(0)), now);
  }
  if (which < kTilt) return on_length(which - kPressures, value, now);
  if (is_yes_or_no(field.info())) return accept(channel, raw == field.on ? 1 : 0, true, 0, now);
  if (is_reading(which)) return accept(channel, value, std::isfinite(value), value, now);
  if (which >= kPilotsPlace) return accept(channel, value, possible_pilot(field, value), value, now);
  if (tilt_on_boom_) return on_boom_tilt(channel, value, now);
  accept(channel, value, std::abs(value) <= kValidity.hull_tilt_rad, value, now);
}

void SensorSet::accept(Channel& channel, double value, bool possible, double shown, Time now) noexcept {
  channel.short_bytes.reset();
  channel.void_by = 0;
  if (possible) {
    channel.value = value;
    channel.at = now;
    channel.bad = 0;
    return;
  }
  channel.bad = std::min(channel.bad + 1, kValidity.bad_in_a_row);
  channel.worst = shown;
}

void SensorSet::refuse_void(Channel& channel, float why) noexcept {
  accept(channel, 0, false, 0, channel.at);
  channel.void_by = why;
}

void SensorSet::refuse_short(Channel& channel, std::size_t bytes) noexcept {
  channel.bad = std::min(channel.bad + 1, kValidity.bad_in_a_row);
  channel.short_bytes = static_cast<std::uint8_t>(bytes);
}

void SensorSet::on_pressure(Channel& channel, double pressure_Pa, unsigned status, Time now) noexcept {
  const bool status_bad = (status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0;
  const bool in_range = pressure_Pa >= kValidity.pressure_floor_Pa && pressure_Pa <= pressure_ceiling_Pa_;
  accept(channel, pressure_Pa, !status_bad && in_range, status_bad ? status : pressure_Pa, now);
}

void SensorSet::on_length(std::size_t joint, double reading, Time now) noexcept {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Channel& channel = channels_[kPressures + joint];
  const auto axis = static_cast<int>(joint);
  const double length = lengths_.length_m(axis, reading).value_or(kNone) - encoder_offset_m_[axis];
  const bool in_range = length >= shortest_m_[joint] && length <= longest_m_[joint];
  // No longer than a value may be used: with all of its age, waiting would make every jump of a slipped drum possible.
  const Duration since = std::min(now - channel.at, age_limit_);
  const double allowed = jump_m_[axis] + kValidity.cylinder_mps * to_seconds(since);
  const bool reachable = channel.at == kNever || std::abs(length - channel.value) <= allowed;
  accept(channel, length, in_range && reachable, std::isnan(length) ? reading : length, now);
  if (reachable)
    channel.settled = 0;
  else
    settle(joint, length, in_range);
}

void SensorSet::settle(std::size_t joint, double length_m, bool in_range) noexcept {
  Channel& channel = channels_[kPressures + joint];
  const double moved_m = std::abs(length_m - channel.elsewhere);
  const bool still = in_range && channel.settled > 0 && moved_m <= jump_m_[static_cast<Eigen::Index>(joint)];
  if (!still) channel.elsewhere = length_m;
  channel.settled = in_range ? std::min(still ? channel.settled + 1 : 1, kValidity.settled_in_a_row) : 0;
}

void SensorSet::believe_settled_length(const Reason& asked, Time now) noexcept {
  for (std::size_t i = kPressures; i < kTilt; ++i) {
    Channel& channel = channels_[i];
    if (channel.subject != asked.subject || channel.settled < kValidity.settled_in_a_row) continue;
    channel.value = channel.elsewhere;
    channel.at = now;
    channel.bad = channel.settled = 0;
  }
}

/// The boom's slope less its angle is the hull's, but for the acceleration that the sensor feels as well: a boom that
/// stops hard can turn the felt vertical by a right angle for a moment. So the hull is let turn slowly only.
void SensorSet::on_boom_tilt(Channel& channel, double slope_rad, Time now) noexcept {
  if (!(std::abs(slope_rad) <= std::numbers::pi)) return accept(channel, 0, false, slope_rad, now);
  const Channel& length = channels_[kPressures + kBoom];
  const auto boom_rad = kinematics_.joint_at(kBoom, length.value);
  if (length.at == kNever || !boom_rad) return;  // ages
  const double pitch = slope_rad - *boom_rad;
  const bool possible = std::abs(pitch) <= kValidity.hull_tilt_rad;
  shaken_ = possible ? 0 : std::min(shaken_ + 1, kValidity.shaken_in_a_row);
  const double bound = std::clamp(pitch, -kValidity.hull_tilt_rad, kValidity.hull_tilt_rad);
  const double turn = kValidity.hull_turn_radps * to_seconds(now - channel.at);
  const double held = channel.at == kNever ? bound : std::clamp(bound, channel.value - turn, channel.value + turn);
  accept(channel, held, shaken_ < kValidity.shaken_in_a_row, slope_rad, now);
}

Reason SensorSet::fault(Time now) const noexcept {
  for (std::size_t i = 0; i < kChannels; ++i) {
    if (!is_reading(i) && counts(i) && channels_[i].bad >= kValidity.bad_in_a_row) return impossible(i);
  }
  const auto stale = [&](const Channel& channel, Duration limit) -> Reason {
    const Duration age = now - channel.at;
    if (age <= limit) return {};
    // Frames slower than a third of the limit are too old before so many of them are bad.
    if (channel.void_by != 0) return impossible(static_cast<std::size_t>(&channel - channels_.data()));
    return {ReasonCode::kSensorStale, silent_subject(channel), to_ms(age), to_ms(limit)};
  };
  const Reason old = stale(oldest(), age_limit_);
  if (old) return old;
  for (std::size_t i = kStatusPlace; i < kChannels; ++i) {
    if (is_reading(i) || !counts(i)) continue;
    if (const Reason why = stale(channels_[i], channels_[i].age_limit)) return why;
  }
  return stale(channels_[kTilt], tilt_age_limit_);
}

MachineReadings SensorSet::readings(Time now) const noexcept {
  MachineReadings all;
  const Channel* channel = &channels_[kReadingsPlace];
  MachineReadings::fields(all, [&](const char*, double& value) {
    if (channel->at != kNever && channel->bad == 0 && now - channel->at <= channel->age_limit) value = channel->value;
    ++channel;
  });
  return all;
}

Reason SensorSet::impossible(std::size_t which) const noexcept {
  const Channel& channel = channels_[which];
  if (channel.settled >= kValidity.settled_in_a_row && !channel.short_bytes) {
    return {ReasonCode::kLengthElsewhere, channel.subject, 1e3 * (channel.elsewhere - channel.value),
            1e3 * jump_m_[static_cast<Eigen::Index>(which - kPressures)]};
  }
  const bool all = channel.node != 0 && std::none_of(channels_.begin(), channels_.end(), [&](const Channel& other) {
                     return other.node == channel.node && other.bad < kValidity.bad_in_a_row;
                   });
  const std::uint8_t subject = all ? channel.node : channel.subject;
  if (channel.short_bytes) return Reason(ReasonCode::kFrameShort, subject, *channel.short_bytes, channel.mapped);
  return {ReasonCode::kSensorInvalid, subject, channel.worst, channel.void_by};
}

/// Of what has stopped coming: the node where nothing has come from it since.
std::uint8_t SensorSet::silent_subject(const Channel& channel) const noexcept {
  const bool lives = channel.node == 0 || std::any_of(channels_.begin(), channels_.end(), [&](const Channel& other) {
                       return other.node == channel.node && other.at > channel.at + age_limit_ / 2;
                     });
  return lives ? channel.subject : channel.node;
}

Reason SensorSet::unreachable() const noexcept {
  for (int joint = 0; joint < kJoints; ++joint) {
    const Channel& length = channels_[kPressures + static_cast<std::size_t>(joint)];
    if (length.at == kNever || kinematics_.joint_at(joint, length.value)) continue;
    return {ReasonCode::kSensorInvalid, length.subject, length.value};
  }
  return {};
}

const SensorSet::Channel& SensorSet::oldest() const noexcept {
  const Channel* oldest = nullptr;
  for (std::size_t i = 0; i < kTilt; ++i)
    if (counts(i) && (oldest == nullptr || channels_[i].at < oldest->at)) oldest = &channels_[i];
  return *oldest;  // lengths always count
}

Time SensorSet::oldest_at() const noexcept {
  return oldest().at;
}
std::uint8_t SensorSet::oldest_node() const noexcept {
  return oldest().node;
}
std::uint8_t SensorSet::oldest_subject() const noexcept {
  return silent_subject(oldest());
}

Time SensorSet::newest_at() const noexcept {
  return std::max_element(channels_.begin(), channels_.begin() + kStatusPlace,
                          [](const Channel& a, const Channel& b) { return a.at < b.at; })
      ->at;
}

std::optional<estimation::Measurement> SensorSet::measurement() const noexcept {
  if (oldest_at() == kNever || channels_[kTilt].at == kNever) return std::nullopt;
  estimation::Measurement m;
  for (std::size_t i = 0; i < kPressures; ++i)
    if (counts(i)) m.pressure_Pa[i] = channels_[i].value;
  m.pressures_known = pressures_count_;
  for (int i = 0; i < kJoints; ++i) m.cylinder_m[i] = channels_[kPressures + static_cast<std::size_t>(i)].value;
  m.hull_pitch_rad = channels_[kTilt].value;
  return m;
}

}  // namespace knuckle::slave
