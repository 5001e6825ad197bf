#include "slave/safety_gate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace knuckle::slave {
namespace {

bool is_neutral(const JointVector& commands) noexcept {
  return (commands.array() == 0).all();
}

Reason pressure_reason(std::size_t chamber, double pressure_Pa, const GateLimits& limits) noexcept {
  return {ReasonCode::kPressureLimit, chamber, pressure_Pa / 1e5, limits.file.chamber_pressure_Pa / 1e5};
}

/// Of the oldest sensor value.
Reason stale(Time oldest_at, std::uint8_t subject, const GateLimits& limits, Time now) noexcept {
  if (now - oldest_at <= limits.state_age) return {};
  return {ReasonCode::kSensorStale, subject, to_ms(now - oldest_at), to_ms(limits.state_age)};
}

/// Why nothing at all may pass; kNone where commands may be limited and sent.
Reason refusal(const JointVector& wanted, Mode mode, Time setpoint_at, const GateState& state, const GateLimits& limits,
               Time now) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    if (!std::isfinite(wanted[i])) return {ReasonCode::kCommandInvalid, i, wanted[i], limits.table.command};
    if (mode != Mode::kEngaged && wanted[i] != 0) return {ReasonCode::kCommandInvalid, i, wanted[i], 0};
  }
  if (mode != Mode::kEngaged) return {};  // neutral was asked and neutral is sent
  if (setpoint_at > now) return {ReasonCode::kSetpointInvalid, 0, -to_ms(setpoint_at - now), 0};
  if (now - setpoint_at >= limits.table.setpoint_age)
    return {ReasonCode::kLinkLost, 0, to_ms(now - setpoint_at), to_ms(limits.table.setpoint_age)};
  const bool finite =
      state.angle_rad.allFinite() && state.lever_m.allFinite() &&
      std::all_of(state.pressure_Pa.begin(), state.pressure_Pa.end(), [](double p) { return std::isfinite(p); });
  if (!state.valid || !finite || state.oldest_at > now) return {ReasonCode::kSensorInvalid, state.oldest_subject};
  return stale(state.oldest_at, state.oldest_subject, limits, now);
}

/// Why nothing of a first motion may pass, nor pilot pressure stay on. Every chamber's pressure counts: which one is
/// driven is not known yet.
Reason jog_refusal(const JointVector& wanted, const JogState& state, const GateMemory& memory, const GateLimits& limits,
                   Time now) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    const double most = i == state.joint ? limits.jog.command : 0;
    if (!(std::abs(wanted[i]) <= most)) return {ReasonCode::kCommandInvalid, i, wanted[i], most};
  }
  if (is_neutral(wanted) && !state.pilot) return {};
  if (state.e_stop_open) return {ReasonCode::kEmergencyStop};
  if (!is_neutral(memory.sent) && now - memory.at > limits.longest_gap)
    return {ReasonCode::kLoopOverrun, 0, to_ms(now - memory.at), to_ms(limits.longest_gap)};
  if (!is_neutral(wanted) && (now < state.since || now - state.since > limits.jog.longest))
    return {ReasonCode::kJogTooLong, 0, to_seconds(now - state.since), to_seconds(limits.jog.longest)};
  if (state.invalid_subject != 0) return {ReasonCode::kSensorInvalid, state.invalid_subject, 1, 0};
  if (state.oldest_at > now) return {ReasonCode::kSensorInvalid, state.oldest_subject};
  if (const Reason old = stale(state.oldest_at, state.oldest_subject, limits, now)) return old;
  for (int i = 0; i < kJoints; ++i) {
    const double travelled_m = std::abs(state.travelled_m[i]), most_m = limits.jog.other_travel_m;
    if (i == state.joint || travelled_m <= most_m) continue;  // a NaN is not
    return {ReasonCode::kJogOtherMoves, i, 1e3 * travelled_m, 1e3 * most_m};
  }
  for (std::size_t i = 0; i < state.pressure_Pa.size(); ++i) {
    if (state.pressure_Pa[i] <= limits.file.chamber_pressure_Pa) continue;  // a NaN is not
    return pressure_reason(i, state.pressure_Pa[i], limits);
  }
  return {};
}

}  // namespace

/// One pass over the commands; every rule only ever takes opening away.
class GateLimiter {
 public:
  GateLimiter(const JointVector& wanted, const GateState& state, const GateLimits& limits) noexcept
      : commands_(wanted), state_(state), limits_(limits) {
    double load = 0;
    for (int i = 0; i < kJoints; ++i) {
      if (flow_share(i) <= 0) continue;
      load = std::max(load, known(i) ? state_.pressure_Pa[driven_chamber(i)] : worst_load_Pa());
      if (known(i)) known_load_Pa_ = std::max(known_load_Pa_, state_.pressure_Pa[driven_chamber(i)]);
    }
    supply_Pa_ = load + limits_.load_sensing_margin_Pa;
  }

  void magnitude() noexcept {
    for (int i = 0; i < kJoints; ++i) {
      cap(i, limits_.table.command, kLimitMagnitude);
      if (const auto rate = full_rate(i); rate && commands_[i] != 0)
        cap(i, limits_.max_rate_radps[i] / *rate, kLimitVelocity);
    }
  }

  /// Slow, where a cylinder's transmitters failed: nobody knows what it presses.
  void home() noexcept {
    if (!state_without_measured()) return;
    for (int i = 0; i < kJoints; ++i) {
      cap(i, limits_.table.home, kLimitHome);
      if (commands_[i] == 0) continue;
      cap_flow(i, limits_.table.home * limits_.max_rate_radps[i] / fastest_at_full_opening(i), kLimitHome);
    }
  }

  /// No command that moves a joint further out; slower and slower towards its end.
  void joint_range() noexcept {
    for (int i = 0; i < kJoints; ++i) {
      const double direction = joint_direction(i);
      if (direction == 0) continue;
      const double bound = direction > 0 ? limits_.max_rad[i] : limits_.min_rad[i];
      const double left_rad = direction * (bound - state_.angle_rad[i]);
      if (cap_speed(i, left_rad / (limits_.table.range_stop_s + limits_.frames_stop_s), kLimitJointRange)) {
        const double deg = 180 / std::numbers::pi;
        tell({ReasonCode::kJointLimit, i, state_.angle_rad[i] * deg, bound * deg});
      }
    }
  }

  /// No command that moves the tip further in, joint by joint: sums of outward parts are outward.
  void virtual_walls() noexcept {
    const PlanarVector tip = limits_.kinematics.tip(state_.angle_rad);
    const PlanarJacobian jacobian = limits_.kinematics.tip_jacobian(state_.angle_rad);
    wall(0, tip.y() - limits_.file.floor_m, -jacobian.row(1), tip.y(), limits_.file.floor_m);
    wall(1, limits_.file.ceiling_m - tip.y(), jacobian.row(1), tip.y(), limits_.file.ceiling_m);
    wall(2, limits_.file.reach_m - tip.x(), jacobian.row(0), tip.x(), limits_.file.reach_m);
  }

  /// No command that feeds a chamber beyond its limit.
  void chamber_pressure() noexcept {
    for (int i = 0; i < kJoints; ++i) {
      if (commands_[i] == 0 || !known(i)) continue;
      const std::size_t chamber = driven_chamber(i);
      const double left_Pa = limits_.file.chamber_pressure_Pa - state_.pressure_Pa[chamber];
      if (cap_flow(i, left_Pa / limits_.table.pressure_band_Pa, kLimitPressure))
        tell(pressure_reason(chamber, state_.pressure_Pa[chamber], limits_));
    }
  }

  /// Pump pressure (highest driven chamber plus margin) times the flow asked for.
  void power() noexcept {
    double flow = 0;
    for (int i = 0; i < kJoints; ++i) flow += flow_share(i) * full_flow(i);
    const double watts = std::min(flow, limits_.pump_flow_m3ps) * supply_Pa_;
    if (watts <= limits_.file.power_W) return;
    tell({ReasonCode::kPowerLimit, 0, watts / 1e3, limits_.file.power_W / 1e3});
    const double share = limits_.file.power_W / (flow * supply_Pa_);
    for (int i = 0; i < kJoints; ++i) {
      if (flow_share(i) > 0) cap_flow(i, flow_share(i) * share, kLimitPower);
    }
  }

  /// Slow away from zero, at once towards it. Inside the dead band nothing opens, so nothing is limited there.
  void rate(const GateMemory& memory, Time now) noexcept {
    for (int i = 0; i < kJoints; ++i) open_from(i, dead_band(i), limits_.table.away_1ps, memory, now);
  }
  /// Likewise from zero on: no dead band has been measured yet.
  void jog_rate(const GateMemory& memory, Time now) noexcept {
    for (int i = 0; i < kJoints; ++i) open_from(i, 0, limits_.jog.away_1ps, memory, now);
  }

  [[nodiscard]] PassedCommands commands() const noexcept { return PassedCommands(commands_); }
  [[nodiscard]] std::uint16_t flags() const noexcept { return flags_; }
  [[nodiscard]] const Reason& limiting() const noexcept { return limiting_; }

 private:
  const ValveDescription& valve(int i) const noexcept { return limits_.valve[static_cast<std::size_t>(i)]; }
  bool known(int i) const noexcept { return state_.pressures_known[static_cast<std::size_t>(i)]; }
  bool state_without_measured() const noexcept {
    for (int i = 0; i < kJoints; ++i)
      if (limits_.pressures_measured[static_cast<std::size_t>(i)] && !known(i)) return true;
    return false;
  }
  double worst_load_Pa() const noexcept { return limits_.main_relief_Pa - limits_.load_sensing_margin_Pa; }
  double dead_band(int i) const noexcept { return limits_.full_rate_radps ? 0 : valve(i).dead_band(commands_[i] > 0); }
  /// Where the machine's own controller makes the command a speed, pressures and valves have no part in it [rad/s].
  [[nodiscard]] std::optional<double> full_rate(int i) const noexcept {
    if (!limits_.full_rate_radps) return std::nullopt;
    return (*limits_.full_rate_radps)[commands_[i] > 0 ? 1 : 0][i];
  }
  /// Of the flow at full opening that the command lets through; 0 inside the dead band.
  double flow_share(int i) const noexcept {
    if (limits_.full_rate_radps) return std::abs(commands_[i]);
    return valve(i).flow_share(valve(i).opening(commands_[i]), commands_[i] > 0);
  }
  std::size_t driven_chamber(int i) const noexcept {
    return static_cast<std::size_t>(2 * i + (commands_[i] > 0 ? 0 : 1));
  }
  /// Which way the joint turns: a cylinder that extends turns it by the sign of its lever; 0 where nothing is asked.
  double joint_direction(int i) const noexcept {
    const double product = commands_[i] * state_.lever_m[i];
    return product > 0 ? 1 : product < 0 ? -1 : 0;
  }
  /// Flow at full opening from what the pump then supplies [m3/s].
  double full_flow(int i) const noexcept {
    if (const auto rate = full_rate(i)) return *rate * std::abs(state_.lever_m[i]) * driven_area_m2(i);
    const double drop_Pa =
        std::max(limits_.load_sensing_margin_Pa, supply_Pa_ - (known(i) ? state_.pressure_Pa[driven_chamber(i)] : 0));
    return valve(i).nominal_flow_m3ps * std::sqrt(drop_Pa / valve(i).nominal_drop_Pa);
  }
  /// Joint speed at full opening [rad/s].
  double full_speed(int i) const noexcept {
    if (const auto rate = full_rate(i)) return *rate;
    return std::min(full_flow(i), limits_.pump_flow_m3ps) / driven_area_m2(i) / std::abs(state_.lever_m[i]);
  }
  double driven_area_m2(int i) const noexcept {
    return commands_[i] > 0 ? limits_.head_area_m2[i] : limits_.rod_side_area_m2[i];
  }

  /// Joint speed at full opening, whichever edge lets more oil through: the one that the pump feeds, its own flow not
  /// counted, or the other under a load that runs ahead [rad/s]. Nothing that hangs on a cylinder without pressures
  /// weighs more than the pump could lift.
  double fastest_at_full_opening(int i) const noexcept {
    if (const auto rate = full_rate(i)) return *rate;
    const std::size_t in = driven_chamber(i), out = in ^ 1U;
    const double in_Pa =
        known(i) ? supply_Pa_ - state_.pressure_Pa[in] : known_load_Pa_ + limits_.load_sensing_margin_Pa;
    const double out_Pa = known(i) ? state_.pressure_Pa[out] : limits_.main_relief_Pa;
    const double head_m2 = limits_.head_area_m2[i], rod_m2 = limits_.rod_side_area_m2[i];
    const bool extends = commands_[i] > 0;
    const double fed = std::sqrt(std::max(limits_.load_sensing_margin_Pa, in_Pa)) / (extends ? head_m2 : rod_m2);
    const double let_out = std::sqrt(std::max(0.0, out_Pa)) / (extends ? rod_m2 : head_m2);
    return valve(i).nominal_flow_m3ps / std::sqrt(valve(i).nominal_drop_Pa) * std::max(fed, let_out) /
           std::abs(state_.lever_m[i]);
  }

  /// @param free up to here at once.
  void open_from(int i, double free, double away_1ps, const GateMemory& memory, Time now) noexcept {
    const Duration since = std::clamp(now - memory.at, Duration::zero(), limits_.table.longest_step);
    const bool same_side = commands_[i] * memory.sent[i] > 0;
    const double from = std::max(same_side ? std::abs(memory.sent[i]) : 0.0, free);
    cap(i, from + away_1ps * to_seconds(since), kLimitRate);
  }
  bool cap(int i, double limit, LimitFlag flag) noexcept {
    if (std::abs(commands_[i]) <= limit) return false;
    commands_[i] = std::copysign(limit, commands_[i]);
    flags_ |= flag;
    return true;
  }
  /// @param limit_share of the nominal flow; at or below zero nothing may be sent at all.
  bool cap_flow(int i, double limit_share, LimitFlag flag) noexcept {
    if (limit_share <= 0) return cap(i, 0, flag);
    if (limits_.full_rate_radps) return cap(i, limit_share, flag);
    const double opening = valve(i).opening_for(limit_share, commands_[i] > 0);
    return opening < 1 && cap(i, dead_band(i) + opening * (1 - dead_band(i)), flag);
  }
  bool cap_speed(int i, double limit_radps, LimitFlag flag) noexcept {
    return cap_flow(i, limit_radps / full_speed(i), flag);
  }

  /// @param inward tip speed into the wall per joint rate [m/rad].
  void wall(std::uint8_t which, double left_m, const Eigen::RowVector3d& inward, double seen_m,
            double bound_m) noexcept {
    bool hit = false;
    for (int i = 0; i < kJoints; ++i) {
      const double lever_m = inward[i] * joint_direction(i);
      if (lever_m <= 0) continue;
      // A third each: three joints together may use up what is left.
      hit |= cap_speed(i, left_m / (kJoints * (limits_.table.wall_stop_s + limits_.frames_stop_s) * lever_m),
                       kLimitVirtualWall);
    }
    if (hit) tell({ReasonCode::kVirtualWall, which, seen_m, bound_m});
  }

  void tell(const Reason& reason) noexcept {
    if (!limiting_) limiting_ = reason;
  }

  JointVector commands_;
  const GateState& state_;
  const GateLimits& limits_;
  double supply_Pa_ = 0;      // highest driven chamber plus load-sensing margin
  double known_load_Pa_ = 0;  // highest driven chamber that is measured
  std::uint16_t flags_ = 0;
  Reason limiting_;
};

namespace {

template <typename Get>
JointVector per_joint(Get get) {
  return {get(0), get(1), get(2)};
}

GateResult passed(const GateLimiter& limiter, Time now) noexcept {
  GateResult result;
  result.commands = limiter.commands();
  result.limits = limiter.flags();
  result.limiting = limiter.limiting();
  result.memory = {result.commands.value(), now};
  return result;
}

}  // namespace

GateLimits::GateLimits(const MachineDescription& machine, const GateTable& constants)
    : table(constants),
      state_age(from_seconds(machine.bus.sensor_age_limit_s)),
      longest_gap(from_seconds(machine.bus.valve_watchdog_s)),
      min_rad(per_joint([&](std::size_t i) { return machine.links[i].min_rad; })),
      max_rad(per_joint([&](std::size_t i) { return machine.links[i].max_rad; })),
      max_rate_radps(per_joint([&](std::size_t i) { return machine.links[i].max_rate_radps; })),
      pressures_measured{true, true, true},
      valve{machine.cylinders[kBoom].valve, machine.cylinders[kArm].valve, machine.cylinders[kBucket].valve},
      head_area_m2(per_joint([&](std::size_t i) { return machine.cylinders[i].head_area_m2(); })),
      rod_side_area_m2(per_joint([&](std::size_t i) { return machine.cylinders[i].rod_side_area_m2(); })),
      file(machine.limits),
      load_sensing_margin_Pa(machine.hydraulics.load_sensing_margin_Pa),
      pump_flow_m3ps(machine.hydraulics.pump_flow_m3ps),
      main_relief_Pa(machine.hydraulics.main_relief_Pa),
      kinematics(machine) {
  if (machine.bus.by_frames()) frames_stop_s = machine.bus.joint_period_s() + constants.own_controller_s;
  if (machine.bus.command_kind == CommandKind::kJointRate) {
    full_rate_radps.emplace();
    for (const bool extend : {false, true})
      (*full_rate_radps)[extend ? 1 : 0] =
          per_joint([&](std::size_t i) { return machine.bus.full_rate_radps(static_cast<int>(i), extend); });
  }
  if (const int without = machine.sensors.without_pressures; without != SensorDescription::kNone)
    pressures_measured[static_cast<std::size_t>(without)] = false;
}

GateResult safety_gate(const JointVector& wanted, Mode mode, Time setpoint_at, const GateState& state,
                       const GateMemory& memory, const GateLimits& limits, Time now) noexcept {
  GateResult result;
  result.memory.at = now;
  result.fault = refusal(wanted, mode, setpoint_at, state, limits, now);
  if (result.fault || mode != Mode::kEngaged) return result;

  GateLimiter limiter(wanted, state, limits);
  limiter.magnitude();
  limiter.home();
  limiter.joint_range();
  limiter.virtual_walls();
  limiter.chamber_pressure();
  limiter.power();
  limiter.rate(memory, now);
  return passed(limiter, now);
}

GateResult jog_gate(const JointVector& wanted, const JogState& state, const GateMemory& memory,
                    const GateLimits& limits, Time now) noexcept {
  GateResult result;
  result.memory.at = now;
  result.fault = jog_refusal(wanted, state, memory, limits, now);
  if (result.fault) return result;

  const GateState unknown;
  GateLimiter limiter(wanted, unknown, limits);
  limiter.jog_rate(memory, now);
  return passed(limiter, now);
}

}  // namespace knuckle::slave
