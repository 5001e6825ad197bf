#include "slave/slave_loop.h"

#include <algorithm>
#include <utility>

#include "slave/slave_state.h"

namespace knuckle::slave {
SlaveLoop::SlaveLoop(const MachineDescription& machine, CanBus& bus, Link& link, const LinkStart& start)
    : step_s_(1 / machine.bus.sync_Hz),
      longest_gap_(from_seconds(machine.bus.valve_watchdog_s)),
      link_(link),
      bus_(bus),
      client_(machine, bus),
      j1939_(machine.bus),
      sensors_(machine),
      plausibility_(machine, step_s_),
      valve_monitor_(step_s_),
      unseen_spool_(machine, step_s_),
      pilot_monitor_(machine, step_s_),
      motion_monitor_(machine, step_s_),
      filter_(machine, step_s_, kVelocityCutoff_Hz),
      force_(machine, step_s_),
      payload_(machine, step_s_),
      object_cue_(machine, step_s_),
      control_(machine, step_s_),
      gate_limits_(machine),
      operator_(machine, link, start),
      home_(machine),
      rest_rate_(kRestCutoff_Hz, step_s_, JointVector::Zero()) {
  for (int joint = 0; joint < kJoints; ++joint)
    if (tells_pilots(machine.bus, joint)) pilots_[static_cast<std::size_t>(joint)].emplace(machine, joint);
}

void SlaveLoop::step(Time now) noexcept {
  gap_ = stepped_at_ == kNever ? Duration::zero() : now - stepped_at_;
  stepped_at_ = now;
  receive_frames(now);
  client_.begin_step(now);
  estimate(now);
  watch_sensors(now);
  operator_.step(now, state_ ? std::optional(state_->angle_rad) : std::nullopt, decision_.state.mode == Mode::kEngaged);
  watch_digging();
  decision_ = next_mode(decision_.state, observe(now));
  command(now);
  if (client_.commanded()) j1939_.step(bus_, now);
  client_.end_step(gate_.commands, led(decision_.state.mode), now, j1939_.may_command());
  ++sequence_;
  link_.send(encode(message(now)).view());
  restart_nodes_once_released(now);
  go_on_if_asked(now);
  go_home_if_chosen(now);
}

void SlaveLoop::receive_frames(Time now) noexcept {
  CanFrame frame;
  for (int i = 0; i < kMostFramesPerStep && bus_.receive(frame); ++i) {
    if (j1939_.receive(frame, now) && !client_.receive(frame, now)) sensors_.receive(frame, now);
    if (const auto message = j1939_.message()) sensors_.receive(message->id, message->data, now);
  }
}

void SlaveLoop::estimate(Time now) noexcept {
  const auto measurement = sensors_.measurement();
  sensor_fault_ = sensors_.fault(now);
  if (!measurement || sensor_fault_) {
    restart_motion();
    if (!measurement) state_.reset();
    return;
  }
  state_ = filter_.step(*measurement);
  if (!state_) {
    restart_motion();
    sensor_fault_ = sensors_.unreachable();
    return;
  }
  newest_state_ = *state_;
  measured_at_ = sensors_.newest_at();
  rest_rate_.step(state_->rate_radps);
  force_.step(*state_);
  payload_.step(*state_, force_.estimate());
  force_.hold_bias(payload_.maybe_loaded());
  force_.carry(payload_.carried());
  // What contradicted the others still does while that is the fault.
  if (!home_.cylinder_of(decision_.state.fault)) home_.note_pressed(force_.estimate().contact, now);
  // Noise of estimate and speed would add up to energy that nothing put in.
  if (force_.estimate().significant && led(decision_.state.mode))
    energy_in_J_ += std::max(0.0, force_.estimate().joint_torque_Nm.dot(state_->rate_radps)) * step_s_;
}

/// Old values say nothing of speed: when they come back, all that knows motion starts at rest. A jump over a gap would
/// be taken for speed, and that for a force.
void SlaveLoop::restart_motion() noexcept {
  filter_.reset();
  force_.restart_motion();
  payload_.restart_motion();
  object_cue_.restart_motion();
  rest_rate_.reset(JointVector::Zero());
}

/// Assist: what stopped the digging stays a reason to hold until the operator has let go of enable. An object that the
/// bucket still touches when it is pressed again is known to the operator then.
void SlaveLoop::watch_digging() noexcept {
  if (!operator_.enable()) object_ = {};
  if (!state_ || sensor_fault_) return;
  const bool before = object_cue_.on();
  const bool met = object_cue_.step(*state_, force_.estimate()) && !before;
  if (!met || !operator_.message().assist.stop_on_object || decision_.state.mode != Mode::kEngaged) return;
  object_ = {ReasonCode::kBuriedObject, 0, 1e-3 * object_cue_.stiffness_N_per_m(),
             1e-3 * estimation::BuriedObjectCue::kStiffness_N_per_m};
}

/// Sensors and valves against each other, once everything runs.
void SlaveLoop::watch_sensors(Time now) noexcept {
  valve_reason_ = {};
  read_pilots();
  unseen_spool_.step(client_.demand(), piloted_);
  const auto measurement = sensors_.measurement();
  if (!client_.operational() || !measurement || sensor_fault_) {
    plausibility_.reset();
    valve_monitor_.reset();
    unseen_spool_.forget_commands();
    pilot_monitor_.reset();
    motion_monitor_.reset();
    unasked_since_ = kNever;
    return;
  }
  sensor_fault_ = plausibility_.step(*measurement, spool(), {client_.demand(), pilot_Pa_});
  if (led(decision_.state.mode)) home_.note_contradiction(sensor_fault_, now);
  valve_reason_ = watch_valves();
  const bool pilot_told = client_.bus().has_enable() || sensors_.tells_pilot();
  if (!pilot_told || !pilot_on() || led(decision_.state.mode))
    unasked_since_ = kNever;
  else if (unasked_since_ == kNever)
    unasked_since_ = now;
  if (unasked_since_ != kNever && now - unasked_since_ > kPilotFalls) valve_reason_ = {ReasonCode::kPilotStaysOn};
}

void SlaveLoop::read_pilots() noexcept {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto extend_Pa = sensors_.pilot_Pa(2 * i), retract_Pa = sensors_.pilot_Pa(2 * i + 1);
    if (!pilots_[i] || !extend_Pa || !retract_Pa) continue;
    pilot_Pa_[2 * i] = *extend_Pa;
    pilot_Pa_[2 * i + 1] = *retract_Pa;
    pilot_opening_[static_cast<int>(i)] = pilots_[i]->opening(*extend_Pa, *retract_Pa);
    piloted_[static_cast<int>(i)] = pilots_[i]->position(*extend_Pa, *retract_Pa);
  }
}

Reason SlaveLoop::watch_valves() noexcept {
  // Without pilot pressure too: a spool that stays open would move its cylinder as soon as there is any.
  if (client_.spools_seen()) return valve_monitor_.step(client_.demand(), client_.spool());
  const Reason by_pilots = pilot_monitor_.step(client_.demand(), pilot_opening_);
  const Reason by_motion =
      state_ ? motion_monitor_.step(client_.demand(), *state_, force_.estimate().contact) : Reason();
  return by_pilots ? by_pilots : by_motion;
}

Reason SlaveLoop::machine_fault() const noexcept {
  if (gap_ > longest_gap_) return {ReasonCode::kLoopOverrun, 0, to_ms(gap_), to_ms(longest_gap_)};
  if (client_.fault()) return client_.fault();
  const Reason of_j1939 = j1939_.fault(stepped_at_);
  return of_j1939 ? of_j1939 : valve_reason_;
}

ModeInputs SlaveLoop::observe(Time now) const noexcept {
  ModeInputs in;
  in.e_stop_open = e_stop_open();
  in.machine_fault = machine_fault();
  in.explains_fault = explains(in.machine_fault, decision_.state.fault, client_.bus());
  in.sensor_fault = sensor_fault_ ? sensor_fault_ : home_.blocking(now);
  in.nodes_operational = client_.operational() && j1939_.may_command();
  in.pilot_on = pilot_on();
  const MasterMessage& message = operator_.message();
  in.link_lost = operator_.set_point().link;
  // The newest set-point counts where the next step may follow it. Elsewhere it may jump: a device is attached anew.
  const bool followed_next = decision_.state.mode == Mode::kAligning || decision_.state.mode == Mode::kHold;
  in.hold = operator_.led_astray() ? operator_.led_astray() : object_;
  if (!in.hold && followed_next) in.hold = operator_.not_by_hand();
  in.late = operator_.set_point().hold;
  in.presence = message.presence;
  in.enable = operator_.enable();
  in.clutch = message.clutch;
  in.stop = operator_.stop();
  if (!message.device_ok) in.device = message.device_reason ? message.device_reason : Reason{ReasonCode::kDeviceLost};
  in.hand_rad = message.position_rad;
  in.hand_radps = message.velocity_radps;
  if (state_) in.machine_rad = state_->angle_rad;
  in.machine_radps = rest_rate_.value();
  return in;
}

void SlaveLoop::command(Time now) noexcept {
  const bool engaged = decision_.state.mode == Mode::kEngaged && state_;
  const LossDecision& followed = operator_.set_point();
  const JointCommand setpoint{followed.position_rad,
                              followed.velocity_radps,
                              engaged,
                              operator_.message().rendered_N,
                              operator_.message().assist.force_limit_N,
                              home_.chosen() ? gate_limits_.table.home : 1};
  const estimation::JointState at_rest;
  control_output_ = control_.step(state_ ? *state_ : at_rest, force_.estimate(), setpoint, gate_.commands.value());
  wanted_ = engaged ? JointVector(control_output_.valve * followed.authority) : JointVector::Zero();

  GateState state;
  state.valid = state_.has_value();
  if (state_) {
    state.angle_rad = state_->angle_rad;
    state.lever_m = state_->lever_m;
    state.pressure_Pa = state_->pressure_Pa;
    state.pressures_known = state_->pressures_known;
  }
  state.oldest_at = sensors_.oldest_at();
  state.oldest_subject = sensors_.oldest_subject();
  gate_ = safety_gate(wanted_, decision_.state.mode, operator_.message_at(), state, gate_.memory, gate_limits_, now);
  if (gate_.fault) decision_ = slave::fault(gate_.fault);  // in the same step
}

/// Nodes that failed are started anew after a while, but only once the operator has let go of enable; nothing moves by
/// that alone, and no length is believed by it that is not where the last one was.
void SlaveLoop::restart_nodes_once_released(Time now) noexcept {
  if (client_.phase() != CanopenClient::Phase::kFailed) {
    failed_at_ = kNever;
    return;
  }
  if (failed_at_ == kNever) failed_at_ = now;
  if (operator_.enable() || now - failed_at_ < kRestartAfter) return;
  // Another controller's nodes are not started anew, and what they say, such as an open E-stop, is not forgotten. Over
  // a bus that has failed they cannot be: once is enough, as nothing that was said before holds any more.
  const bool bus_failed = bus_.state() != CanState::kActive;
  if (client_.watch().foreign(now) || (bus_failed && restarted_in_vain_)) return;
  restarted_in_vain_ = bus_failed;
  client_.restart();
  sensors_.restart();
}

/// The operator acknowledges a fault by pressing and releasing enable while that fault is shown and the machine stands.
/// An enable that merely is not pressed says nothing, nor does a press from before the fault was shown.
bool SlaveLoop::acknowledged() noexcept {
  const Reason& shown = decision_.blocking;
  const bool there = operator_.message().presence && operator_.message().device_ok;
  if (!stopped() || !there || operator_.set_point().link || operator_.set_point().hold) {
    asking_ = Asking::kNothing;
  } else if (!operator_.enable()) {
    return std::exchange(asking_, Asking::kReleased) == Asking::kPressed && still_asked(shown);
  } else if (asking_ == Asking::kReleased) {
    const bool question = shown.code == ReasonCode::kLengthElsewhere || shown.code == ReasonCode::kBusOff ||
                          shown.code == ReasonCode::kHomeOffered || home_.cylinder_of(shown) ||
                          home_.hindered_by(shown);
    asking_ = question ? Asking::kPressed : Asking::kNothing;
    asked_ = shown;
  }
  return false;
}

bool SlaveLoop::stopped() const noexcept {
  const Mode mode = decision_.state.mode;
  return mode == Mode::kSelfTest || mode == Mode::kFault || mode == Mode::kEStop;
}

/// A node that is silent may be told of by its sensors, its heartbeat or its set-up, and stands beside a start-up that
/// is tried again and again.
bool SlaveLoop::still_asked(const Reason& shown) const noexcept {
  const bool beside = shown.code == ReasonCode::kStartingUp;
  if (const auto joint = home_.cylinder_of(asked_))
    return home_.cylinder_of(beside ? decision_.state.fault : shown) == joint;
  if (home_.hindered_by(asked_)) return beside || home_.hindered_by(shown);
  const bool elsewhere = shown.code == ReasonCode::kLengthElsewhere;
  return same_cause(shown, asked_) && (!elsewhere || std::abs(shown.value - asked_.value) <= shown.limit);
}

/// What only the operator can answer for. An encoder that woke far from where it froze, or came back elsewhere after it
/// fell silent, looks like one whose drum slipped. A controller that was bus-off and has been restarted may still be on
/// a bus that nobody has mended. The machine is neutral, and stays so until enable is pressed once more and the hand
/// aligned with what the sensors show then.
void SlaveLoop::go_on_if_asked(Time now) noexcept {
  if (!acknowledged()) return;
  if (asked_.code == ReasonCode::kLengthElsewhere) sensors_.believe_settled_length(asked_, now);
  if (asked_.code == ReasonCode::kBusOff) bus_.acknowledge();
  if (asked_.code == ReasonCode::kHomeOffered || home_.hindered_by(asked_)) {
    home_.withdraw();
    need_pressures(home_.joint(), true);
  } else if (const auto joint = home_.cylinder_of(asked_)) {
    home_.offer(*joint);
    need_pressures(*joint, false);
  }
}

/// Nodes that are needed again, or that fail no more because they are not, are started with all the others.
void SlaveLoop::need_pressures(int joint, bool on) noexcept {
  sensors_.count_pressures(joint, on);
  client_.need_pressures(joint, on);
  if (!on && client_.phase() != CanopenClient::Phase::kFailed) return;
  client_.restart();
  sensors_.restart();
}

void SlaveLoop::go_home_if_chosen(Time now) noexcept {
  const bool known = client_.operational() && state_ && !sensor_fault_;
  home_.look({known, operator_.enable(), rest_rate_.value(), force_.estimate().contact}, now);
  const LossDecision& link = operator_.set_point();
  if (operator_.home() == nullptr || link.link || link.hold || operator_.stop() || e_stop_open()) return;
  home_.choose(operator_.home()->cylinder, now);
}

const Reason& SlaveLoop::blocking() const noexcept {
  if (decision_.state.mode != Mode::kEngaged) return decision_.blocking;
  return gate_.limiting ? gate_.limiting : control_output_.assist;
}

SlaveMessage SlaveLoop::message(Time now) const noexcept {
  SlaveMessage message = message_of(state_of(now, *this));
  message.stamp = operator_.session().stamp(sequence_, now);
  message.sensor_at = operator_.session().to_link(measured_at_);
  message.pressure_Pa = newest_state_.pressure_Pa;
  return message;
}

}  // namespace knuckle::slave
