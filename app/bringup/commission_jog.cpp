#include "app/bringup/commission_jog.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "app/bringup/commission_dialogue.h"
#include "machine/toml_reader.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

constexpr Duration kStartPatience = 10s, kPilotPatience = 1s, kSdoPatience = 3s;
constexpr Duration kSettle = 400ms;  // spools close, pressures settle
constexpr double kStall_s = 0.7, kStall_m = 5e-4, kMoved_m = 2e-3;

/// Whether a motion has reached its end.
class JogEnd {
 public:
  JogEnd(const JogPlan& plan, double from_m) : plan_(plan), from_m_(from_m), still_at_m_(from_m) {}
  JogRun::End step(double t_s, double length_m) noexcept {
    if (std::abs(length_m - still_at_m_) > kStall_m) {
      still_at_m_ = length_m;
      still_since_s_ = t_s;
    }
    const double own_m = std::abs(length_m - from_m_);
    if (own_m >= plan_.travel_m) return JogRun::End::kTravelled;
    const bool still = t_s - still_since_s_ > kStall_s;
    return plan_.until_stall && own_m > kMoved_m && still ? JogRun::End::kStalled : JogRun::End::kTime;
  }

 private:
  const JogPlan& plan_;
  double from_m_, still_at_m_, still_since_s_ = 0;
};

}  // namespace

Time RawSensors::oldest() const noexcept {
  return *std::min_element(at.begin(), at.end());
}

bool RawSensors::invalid() const noexcept {
  return std::any_of(pressure_invalid.begin(), pressure_invalid.end(), [](bool one) { return one; });
}

std::string jog_gate(const JogState& state, const MachineDescription& machine) {
  if (state.e_stop_open) return "the E-stop chain is open";
  if (!(std::abs(state.command) <= kJogLimits.command)) {
    return "command above the limit of " + number_text(kJogLimits.command) + " of stroke";
  }
  if (!(state.elapsed_s <= kJogLimits.longest_s))
    return "the motion takes longer than the limit of " + number_text(kJogLimits.longest_s) + " s";
  if (to_seconds(state.oldest) > machine.bus.sensor_age_limit_s) {
    return "a sensor is stale: no value for " + number_text(std::round(1e3 * to_seconds(state.oldest))) +
           " ms, limit " + number_text(std::round(1e3 * machine.bus.sensor_age_limit_s)) +
           " ms; find it with knuckle doctor --can";
  }
  if (state.invalid) return "a pressure transmitter reports an invalid value: find it with knuckle doctor --can";
  if (!(state.other_travel_m <= kJogLimits.other_travel_m)) {
    return std::string("the ") + kJointNames[static_cast<std::size_t>(state.other_joint)] + " cylinder moved by " +
           number_text(std::round(1e3 * state.other_travel_m)) + " mm without a command, limit " +
           number_text(1e3 * kJogLimits.other_travel_m) +
           " mm: valves, hoses or encoders are exchanged, or a load holding valve leaks";
  }
  for (std::size_t i = 0; i < state.pressure_Pa.size(); ++i) {
    if (state.pressure_Pa[i] <= machine.limits.chamber_pressure_Pa) continue;  // a NaN is not
    return std::string(kJointNames[i / 2]) + (i % 2 == 0 ? " head" : " rod") + " side pressure " +
           number_text(std::round(state.pressure_Pa[i] / 1e5)) + " bar, limit " +
           number_text(std::round(machine.limits.chamber_pressure_Pa / 1e5)) +
           " bar (chamber_pressure_bar): check the load and the relief valves";
  }
  return "";
}

JogBench::JogBench(const MachineDescription& machine, BusAccess& access, std::function<bool()> stopped)
    : machine_(machine),
      access_(access),
      stopped_(std::move(stopped)),
      client_(machine, access.bus()),
      pressure_format_(canopen::pressure_format(machine.bus.wire.pressure_float, machine.bus.wire.pressure_digits)),
      period_(from_seconds(1 / machine.bus.sync_Hz)),
      due_(access.now()) {
  sensors_.at.fill(kNever);
}

/// Missed periods are skipped: a command is never sent twice in a burst.
void JogBench::wait() {
  due_ = std::max(due_ + period_, access_.now());
  access_.wait_until(due_);
  CanFrame frame;
  while (access_.bus().receive(frame)) hear(frame);
}

void JogBench::rest(bool pilot) {
  wait();
  send(JointVector::Zero(), pilot);
}

void JogBench::send(const JointVector& commands, bool pilot) {
  const Time now = access_.now();
  client_.begin_step(now);
  client_.end_step(commands, pilot, now);
  if (telling_) telling_->step(access_.bus(), now);
  if (!client_.fault()) return;
  const std::string details = text(client_.setup_failure());
  throw CommissionEnded(details.empty() ? text(client_.fault()) : details);
}

void JogBench::hear(const CanFrame& frame) noexcept {
  const Time now = access_.now();
  client_.receive(frame, now);
  const BusDescription& bus = machine_.bus;
  for (std::size_t i = 0; i < bus.pressures.size(); ++i) {
    if (frame.id != bus.pressures[i].tpdo_id()) continue;
    const auto reading = canopen::parse_pressure(frame, pressure_format_);
    if (!reading) continue;
    sensors_.pressure_Pa[i] = reading->pressure_Pa;
    sensors_.at[i] = now;
    sensors_.pressure_invalid[i] = (reading->status & (canopen::kPressureInvalid | canopen::kPressureOverload)) != 0;
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (frame.id != bus.encoders[i].tpdo_id()) continue;
    const auto reading = canopen::parse_encoder(frame, machine_.sensors.encoder_step_m);
    if (!reading) continue;
    sensors_.length_m[static_cast<int>(i)] = reading->position_m;
    sensors_.at[6 + i] = now;
  }
  if (frame.id == bus.tilt.tpdo_id()) {
    if (const auto slope = canopen::parse_tilt(frame, machine_.sensors.tilt_step_rad)) {
      sensors_.tilt_rad = *slope;
      sensors_.at[9] = now;
    }
  }
  if (telling_) telling_->receive(frame);
}

void JogBench::idle() {
  rest(false);
}

void JogBench::idle(Duration time) {
  for (const Time end = access_.now() + time; access_.now() < end;) idle();
}

void JogBench::start() {
  client_.restart();
  for (const Time end = access_.now() + kStartPatience; !client_.operational(); idle()) {
    if (access_.now() >= end)
      throw CommissionEnded("not all nodes are operational after 10 s: run knuckle doctor --can");
  }
  for (const Time end = access_.now() + kSettle; sensors_.oldest() == kNever; idle()) {
    if (access_.now() >= end) throw CommissionEnded("a sensor has sent no value: find it with knuckle doctor --can");
  }
}

void JogBench::neutral() noexcept {
  try {
    for (const Time end = access_.now() + kSettle; access_.now() < end;) rest(false);
  } catch (const CommissionEnded&) {
    // A bus that is gone: the nodes' own watchdogs act.
  }
}

void JogBench::require_pilot(bool on) {
  for (const Time end = access_.now() + kPilotPatience; client_.pilot_on() != on;) {
    if (client_.e_stop_open()) throw CommissionEnded("the E-stop chain is open: release the E-stop on the machine");
    if (access_.now() >= end) {
      throw CommissionEnded(
          on ? "no pilot pressure after 1 s: check the enable node's output and the enable valve"
             : "pilot pressure is still on 1 s after switching it off: check the enable valve before anything else");
    }
    rest(on);
  }
}

void JogBench::close() {
  for (const Time end = access_.now() + kSettle; access_.now() < end;) rest(true);
  require_pilot(false);
}

JointVector JogBench::try_pilot(Duration time) {
  const JointVector before = sensors_.length_m;
  require_pilot(true);
  for (const Time end = access_.now() + time; access_.now() < end;) {
    rest(true);
    if (stopped_()) throw CommissionEnded("stopped from the keyboard");
  }
  const JointVector crept = sensors_.length_m - before;
  require_pilot(false);
  return crept;
}

JogSample JogBench::sample(const JogPlan& plan, double t_s, double command) const {
  return {t_s, command, client_.spool()[plan.joint], sensors_.length_m, sensors_.pressure_Pa};
}

void JogBench::guard(const JogPlan& plan, const JogSample& first, const JogSample& next) const {
  JogState state{
      next.command,         next.t_s, 0, 0, next.pressure_Pa, access_.now() - sensors_.oldest(), sensors_.invalid(),
      client_.e_stop_open()};
  for (int j = 0; j < kJoints; ++j) {
    const double travelled = std::abs(next.length_m[j] - first.length_m[j]);
    if (j == plan.joint || travelled <= state.other_travel_m) continue;
    state.other_travel_m = travelled;
    state.other_joint = j;
  }
  if (const std::string why = jog_gate(state, machine_); !why.empty()) throw CommissionEnded(why);
  if (stopped_()) throw CommissionEnded("stopped from the keyboard");
}

JogRun JogBench::run(const JogPlan& plan) {
  require_pilot(true);
  JogRun made{JogRun::End::kTime, plan, {}};
  const Time start = access_.now();
  JogEnd end(plan, sensors_.length_m[plan.joint]);
  do {
    wait();
    const double t_s = to_seconds(access_.now() - start);
    const double command = std::copysign(std::min(std::abs(plan.peak), plan.rise_1ps * t_s), plan.peak);
    made.samples.push_back(sample(plan, t_s, command));
    guard(plan, made.samples.front(), made.samples.back());
    JointVector commands = JointVector::Zero();
    commands[plan.joint] = command;
    send(commands, true);
    made.end = end.step(to_seconds(access_.now() - start), sensors_.length_m[plan.joint]);
  } while (made.end == JogRun::End::kTime && made.samples.back().t_s < plan.longest_s);
  made.samples.push_back(sample(plan, to_seconds(access_.now() - start), made.samples.back().command));
  close();
  return made;
}

void JogBench::write_objects(std::uint8_t node, slave::SdoScript script) {
  telling_.emplace(node, std::move(script), from_seconds(machine_.bus.sdo_timeout_s));
  for (const Time end = access_.now() + kSdoPatience; !telling_->done() && !telling_->failure();) {
    if (access_.now() >= end) break;
    idle();
  }
  const bool done = telling_->done();
  const std::string why = text(telling_->details());
  telling_.reset();
  if (!done) throw CommissionEnded(why.empty() ? "an encoder did not accept its preset within 3 s" : why);
}

}  // namespace knuckle::bringup
