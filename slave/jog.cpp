#include "slave/jog.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "machine/reason_text.h"
#include "slave/sensors.h"
#include "transport/canopen.h"
#include "transport/signal_codec.h"

namespace knuckle::slave {
namespace {

constexpr double kStall_s = 0.7, kStall_m = 5e-4, kMoved_m = 2e-3;
constexpr double kMostStrokes = 2;  // in one motion: a cylinder makes one, and its drawing may be off
constexpr std::size_t kPressures = kSensorPressures, kTilt = kPressures + kJoints;

bool wants_pilot(Jog::Phase phase) noexcept {
  return phase != Jog::Phase::kRest && phase != Jog::Phase::kPilotDown;
}

bool expects_pilot(Jog::Phase phase) noexcept {
  return wants_pilot(phase) && phase != Jog::Phase::kPilotUp && phase != Jog::Phase::kWithheld;
}

/// What a reason about the value at this place of RawSensors::at names.
std::uint8_t subject_at(std::size_t place, const BusDescription& bus) noexcept {
  if (place < kPressures) return subject_of(NodeRole::kPressure, static_cast<int>(place), bus);
  if (place < kTilt) return subject_of(NodeRole::kEncoder, static_cast<int>(place - kPressures), bus);
  return subject_of(NodeRole::kTilt, 0, bus);
}

}  // namespace

Time RawSensors::oldest() const noexcept {
  return *std::min_element(at.begin(), at.end());
}

std::optional<std::size_t> RawSensors::invalid() const noexcept {
  for (std::size_t i = 0; i < impossible.size(); ++i) {
    if (impossible[i] || (i < kPressures && pressure_invalid[i])) return i;
  }
  return std::nullopt;
}

bool possible(const FrameField& field, double value, const MachineDescription& machine) noexcept {
  const NodeRole role = field.channel.info().role;
  if (role == NodeRole::kPressure)
    return value >= kValidity.pressure_floor_Pa &&
           value <= machine.sensors.pressure_range_Pa * kValidity.pressure_over_range;
  // "Broken" is the largest or the smallest integer; before a preset all others may be right.
  if (role == NodeRole::kEncoder)
    return field.bits.type != BitField::Type::kSigned ||
           std::abs((value - field.bits.offset) / field.bits.scale) < std::ldexp(1.0, field.bits.bits - 1) - 1.5;
  const bool on_boom = machine.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom;
  return role != NodeRole::kTilt || std::abs(value) <= (on_boom ? std::numbers::pi : kValidity.hull_tilt_rad);
}

Jog::Jog(const MachineDescription& machine, CanBus& bus)
    : machine_(machine),
      lengths_(machine),
      bus_(bus),
      client_(machine, bus),
      j1939_(machine.bus),
      frames_(bus_frames(machine.bus, machine.sensors)),
      closed_(machine.bus),
      limits_(machine),
      valves_(1 / machine.bus.sync_Hz) {
  sensors_.at.fill(kNever);
  for (const BroadcastFrame& frame : machine.bus.broadcasts) {
    if (frame.only_readings()) continue;
    broadcasts_.push_back(frame);
    for (const BroadcastField& field : frame.fields)
      if (is_status(field.info()))
        status_[static_cast<std::size_t>(field.info().index - kEStopClosedIndex)] = {
            .told = true,
            .subject = signal_subject(field.signal),
            .age_limit = from_seconds(kStatusPeriods * frame.period_s)};
  }
}

void Jog::step(Time now) noexcept {
  stepped_at_ = now;
  sample_.reset();
  hear(now);
  client_.begin_step(now);
  watch_spools();
  watch_pilot();
  watch_creep(now);
  if (const Reason why = j1939_.fault(now)) end_early(why);
  gate_ = jog_gate(wanted(now), judged(now), gate_.memory, limits_, now);
  if (gate_.fault) end_early(gate_.fault);
  if (client_.fault()) end_early(client_.fault());
  using Withheld = CanopenClient::Withheld;
  const Withheld tried = guard_seen_.by_heartbeat ? Withheld::kHeartbeat : Withheld::kSetPoints;
  client_.withhold(phase_ == Phase::kWithheld ? tried : Withheld::kNothing, guarded_);
  ask_guarded(now);
  if (client_.commanded()) j1939_.step(bus_, now);
  client_.end_step(gate_.commands, wants_pilot(phase_), now, j1939_.may_command());
  if (dialogue_) dialogue_->step(bus_, now);
  go_on(now);
}

void Jog::hear(Time now) noexcept {
  CanFrame frame;
  for (int i = 0; i < kMostFramesPerStep && bus_.receive(frame); ++i) {
    if (j1939_.receive(frame, now) && !client_.receive(frame, now)) take(frame, now);
    if (dialogue_ && frame.id == canopen::sdo_response_id(dialogue_->node())) dialogue_->receive(frame);
    hear_inputs(frame, now);
  }
}

void Jog::take(const CanFrame& frame, Time now) noexcept {
  for (const BusFrame& known : frames_) {
    if (known.to_node || known.id != frame.id) continue;
    if (frame.size < known.bytes()) return refuse_short(machine_.bus.nodes[known.node].id, frame.size, known.bytes());
    for (const FrameField& field : known.fields) take(field, read_value(field.bits, frame).value_or(0), now);
  }
  take_broadcast(frame, now);
}

/// What its counter or checksum says to be old or damaged only lets the values before it age.
void Jog::take_broadcast(const CanFrame& frame, Time now) noexcept {
  if (closed_.fault(frame) != FrameFault::kNone) return;
  for (const BroadcastFrame& known : broadcasts_)
    if (known.id == frame.id && known.is_in(frame)) take(known, frame, now);
}

void Jog::take(const BroadcastFrame& known, const CanFrame& frame, Time now) noexcept {
  if (known.fields.empty()) return;
  if (frame.size < known.bytes)
    return refuse_short(signal_subject(known.fields.front().signal), frame.size, known.bytes);
  if (known.module == guarded_) inputs_at_ = now;
  for (const BroadcastField& field : known.fields) take(field, read_raw(field.bits, frame), now);
}

void Jog::take(const BroadcastField& field, std::optional<std::uint64_t> raw, Time now) noexcept {
  const auto value = field.value(raw);
  if (is_status(field.info())) {
    Status& status = status_[static_cast<std::size_t>(field.info().index - kEStopClosedIndex)];
    if (value) status = {status.told, status.subject, status.age_limit, *raw == field.on, now};
    return;
  }
  const std::size_t place = sensor_place({.signal = field.signal});
  if (place >= sensors_.at.size()) return;  // no motion is judged by it
  if (value) return take({FrameField::Part::kValue, {.signal = field.signal}, {}, field.bits}, *value, now);
  sensors_.impossible[place] = true;
  sensors_.at[place] = now;
}

std::optional<bool> Jog::e_stop_open() const noexcept {
  if (machine_.bus.has_enable()) return client_.e_stop_open();
  return status_[0].on ? std::optional(!*status_[0].on) : std::nullopt;
}

/// Where nobody tells: as asked.
bool Jog::pilot_on() const noexcept {
  if (machine_.bus.has_enable()) return client_.pilot_on();
  return tells_pilot() ? status_[1].on.value_or(false) : wants_pilot(phase_);
}

void Jog::take(const FrameField& field, double value, Time now) noexcept {
  const std::size_t place = sensor_place(field.channel);
  if (place >= sensors_.at.size()) return;
  if (field.part == FrameField::Part::kStatus) {
    const unsigned bad = unsigned{canopen::kPressureInvalid} | canopen::kPressureOverload;
    sensors_.pressure_invalid[place] = (static_cast<unsigned>(value) & bad) != 0;
  } else if (field.part == FrameField::Part::kValue) {
    sensors_.at[place] = now;
    // Chambers without a transmitter have no age of their own.
    const int without = machine_.sensors.without_pressures;
    if (without != SensorDescription::kNone && place == kPressures + static_cast<std::size_t>(without))
      sensors_.at[2 * static_cast<std::size_t>(without)] = sensors_.at[2 * static_cast<std::size_t>(without) + 1] = now;
    sensors_.impossible[place] = !possible(field, value, machine_);
    if (place < kPressures)
      sensors_.pressure_Pa[place] = value;
    else if (place < kTilt)
      take_length(field, value);
    else
      sensors_.tilt_rad = value;
  }
}

void Jog::take_length(const FrameField& field, double reading) noexcept {
  const int axis = field.channel.info().index;
  const auto joint = static_cast<std::size_t>(axis);
  bool& impossible = sensors_.impossible[kPressures + joint];
  sensors_.encoder[axis] = reading;
  const auto length_m = lengths_.length_m(axis, reading);
  const CylinderDescription& cylinder = machine_.cylinders[joint];
  const double most_m = kMostStrokes * (cylinder.max_length_m - cylinder.min_length_m);
  impossible = impossible || (length_m && phase_ != Phase::kRest && std::abs(*length_m - from_m_[axis]) > most_m);
  sensors_.no_length[joint] = !length_m;
  if (length_m && !impossible) sensors_.length_m[axis] = *length_m;
}

void Jog::refuse_short(std::uint8_t subject, std::size_t seen_bytes, std::size_t bytes) noexcept {
  if (phase_ == Phase::kRest) return;
  end_early({ReasonCode::kFrameShort, subject, double(seen_bytes), double(bytes)});
}

/// The opening grows with time, up to the plan's peak.
JointVector Jog::wanted(Time now) const noexcept {
  JointVector commands = JointVector::Zero();
  if (phase_ == Phase::kOpening || phase_ == Phase::kWithheld) commands[plan_.joint] = opening_;
  if (phase_ != Phase::kMoving) return commands;
  const double risen = plan_.rise_1ps * to_seconds(now - since_);
  commands[plan_.joint] = std::copysign(std::min(std::abs(plan_.peak), risen), plan_.peak);
  return commands;
}

JogState Jog::judged(Time now) const noexcept {
  JogState state;
  const bool open = phase_ == Phase::kMoving || phase_ == Phase::kClosing || wanted(now) != JointVector::Zero();
  state.joint = open ? plan_.joint : JogState::kNoJoint;
  state.pilot = wants_pilot(phase_);
  state.since = since_;
  state.travelled_m = sensors_.length_m - from_m_;
  state.pressure_Pa = sensors_.pressure_Pa;
  std::array<Time, 10> at = sensors_.at;
  if (at[kTilt] != kNever) at[kTilt] += tilt_extra_age(machine_);
  // What a module says no more while its outputs are tried is asked: see note_silence().
  for (std::size_t place = 0; phase_ == Phase::kWithheld && tries_outputs() && place < at.size(); ++place)
    if (of_module_[place]) at[place] = now;
  const auto oldest = std::min_element(at.begin(), at.end());
  state.oldest_at = *oldest;
  state.oldest_subject = subject_at(static_cast<std::size_t>(oldest - at.begin()), machine_.bus);
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    if (sensors_.no_length[joint]) state.invalid_subject = subject_at(kPressures + joint, machine_.bus);
  }
  for (const Status& status : status_)
    if (status.told && now - status.at > status.age_limit) state.invalid_subject = status.subject;
  if (const Reason why = invalid()) state.invalid_subject = why.subject;
  state.e_stop_open = e_stop_open().value_or(false);
  return state;
}

Reason Jog::invalid() const noexcept {
  const auto place = sensors_.invalid();
  return place ? Reason{ReasonCode::kSensorInvalid, subject_at(*place, machine_.bus), 1, 0} : Reason{};
}

/// What the next step does.
void Jog::go_on(Time now) noexcept {
  switch (phase_) {
    case Phase::kRest:
      return;
    case Phase::kPilotUp:
      return await_pilot(true, with_pilot_, now);
    case Phase::kHeld:
      if (now - since_ >= hold_) enter(Phase::kPilotDown, now);
      return;
    case Phase::kMoving:
      return note_motion(now);
    case Phase::kOpening:
      return open_for_guard(now);
    case Phase::kWithheld:
      return note_guard(now);
    case Phase::kClosing:
      if (now - since_ >= kSettle) enter(Phase::kPilotDown, now);
      return;
    case Phase::kPilotDown:
      return await_pilot(false, Phase::kRest, now);
  }
}

void Jog::await_pilot(bool on, Phase then, Time now) noexcept {
  if (pilot_on() == on) return enter(then, now);
  if (e_stop_open().value_or(false)) return end_early({ReasonCode::kEmergencyStop});
  if (now - since_ >= kPilotPatience) end_early({on ? ReasonCode::kPilotOff : ReasonCode::kPilotStaysOn});
}

/// While a guard is tried the spool is another matter: see open_for_guard() and note_guard().
void Jog::watch_spools() noexcept {
  if (!client_.spools_seen()) return;
  if (phase_ != Phase::kHeld && phase_ != Phase::kMoving && phase_ != Phase::kClosing) return valves_.reset();
  if (const Reason why = valves_.step(client_.demand(), client_.spool())) end_early(why);
}

/// The enable node takes pilot pressure away where a spool does not follow: then that is what to tell.
void Jog::watch_pilot() noexcept {
  // An open E-stop is the gate's to say.
  if (!expects_pilot(phase_) || pilot_on() || e_stop_open().value_or(false)) return;
  const int joint = valves_.suspect();
  if (joint < 0) return end_early({ReasonCode::kPilotOff});
  const double apart = std::abs(client_.demand()[joint] - client_.spool()[joint]);
  end_early({ReasonCode::kValveNotFollowing, joint, apart, ValveMonitor::kTolerance});
}

void Jog::note_sample(Time now) noexcept {
  const double command = gate_.commands[plan_.joint];
  sample_ = {to_seconds(now - since_), command, client_.spools_seen() ? client_.spool()[plan_.joint] : command,
             sensors_.length_m, sensors_.pressure_Pa};
}

void Jog::note_motion(Time now) noexcept {
  const double t_s = to_seconds(now - since_), length_m = sensors_.length_m[plan_.joint];
  note_sample(now);
  if (std::abs(length_m - still_at_m_) > kStall_m) {
    still_at_m_ = length_m;
    still_since_s_ = t_s;
  }
  const double way_m = length_m - from_m_[plan_.joint], own_m = std::abs(way_m);
  if (way_m * plan_.peak < 0 && own_m > plan_.back_m) {
    end_ = JogEnd::kWrongWay;
  } else if (own_m >= plan_.travel_m) {
    end_ = JogEnd::kTravelled;
  } else if (plan_.until_stall && own_m > kMoved_m && t_s - still_since_s_ > kStall_s) {
    end_ = JogEnd::kStalled;
  } else if (t_s >= plan_.longest_s) {
    end_ = JogEnd::kTime;
  } else {
    return;
  }
  const bool silence = plan_.then_silence && end_ == JogEnd::kTravelled;
  if (silence) opening_ = gate_.commands[plan_.joint];
  enter(silence ? Phase::kWithheld : Phase::kClosing, now);
}

void Jog::enter(Phase phase, Time now) noexcept {
  phase_ = phase;
  since_ = now;
  if (phase == Phase::kWithheld) {
    // Since the last one was sent, less one SYNC period of tolerance.
    const BusDescription& bus = machine_.bus;
    const bool heartbeat = guard_seen_.by_heartbeat;
    guard_seen_.guard_s = heartbeat ? bus.controller_timeout_s : bus.valve_watchdog_s;
    const double ago_s = heartbeat ? bus.controller_heartbeat_s : to_seconds(now - client_.set_points_at());
    guard_earliest_s_ = guard_seen_.guard_s - ago_s - 1 / bus.sync_Hz;
  }
  if (phase != Phase::kMoving) return;
  from_m_ = sensors_.length_m;
  still_at_m_ = from_m_[plan_.joint];
  still_since_s_ = 0;
}

void Jog::end_early(const Reason& why) noexcept {
  phase_ = Phase::kRest;
  if (!trouble_) trouble_ = why;
}

void Jog::begin(Phase phase) noexcept {
  with_pilot_ = phase;
  asked_at_ = kNever;
  trouble_ = {};
  from_m_ = sensors_.length_m;
  enter(Phase::kPilotUp, stepped_at_);
}

void Jog::start() noexcept {
  client_.restart();
  end_early({});
  trouble_ = {};
}

void Jog::hold_pilot(Duration time) noexcept {
  if (phase_ != Phase::kRest) return;
  hold_ = time;
  guarded_ = 0;
  begin(Phase::kHeld);
}

void Jog::move(const JogPlan& plan) noexcept {
  if (phase_ != Phase::kRest || plan.joint < 0 || plan.joint >= kJoints) return;
  plan_ = plan;
  guarded_ = 0;
  guard_seen_ = {};  // what is withheld is no heartbeat
  begin(Phase::kMoving);
}

void Jog::stop() noexcept {
  if (phase_ != Phase::kRest) end_early({ReasonCode::kOperatorStop});
}

void Jog::write_objects(std::uint8_t node, SdoScript script) {
  dialogue_.emplace(node, std::move(script), from_seconds(machine_.bus.sdo_timeout_s));
}

}  // namespace knuckle::slave
