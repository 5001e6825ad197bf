#include "slave/motion_monitor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "machine/encoder_length.h"
#include "machine/oil_stiffness.h"
#include "machine/pilot_spool.h"

namespace knuckle::slave {
namespace {

constexpr double kRemembered = 1.1;  // of a limit

Reason not_following(int joint, double seen_rad, double limit_rad) noexcept {
  constexpr double kDeg = 180 / std::numbers::pi;
  return {ReasonCode::kMotionNotFollowing, joint, kDeg * seen_rad, kDeg * limit_rad};
}

}  // namespace

MotionMonitor::MotionMonitor(const MachineDescription& machine, double step_s)
    : machine_(machine),
      kinematics_(machine),
      step_s_(step_s),
      lag_steps_(std::clamp<std::size_t>(static_cast<std::size_t>(kMotion.lag_s / step_s), 1, kSlots)),
      held_Pa_(kMotion.held * machine.hydraulics.main_relief_Pa),
      pushed_Pa_(kMotion.pushed * machine.hydraulics.port_relief_Pa),
      by_rate_(machine.bus.command_kind == CommandKind::kJointRate),
      step_m_(length_steps_m(machine)) {
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    // Where pilot pressures tell the spool, Plausibility looks for the angle that stands, and names the sensor.
    if (tells_pilots(machine.bus, i)) step_m_[i] = std::numeric_limits<double>::infinity();
    for (const bool extend : {false, true}) {
      full_radps_[extend ? 1 : 0][i] =
          by_rate_ ? machine.bus.full_rate_radps(i, extend) : kMotion.any_speed * machine.links[joint].max_rate_radps;
      shut_[extend ? 1 : 0][i] = by_rate_ ? 0 : machine.cylinders[joint].valve.dead_band(extend);
    }
  }
}

void MotionMonitor::reset() noexcept {
  axes_ = {};
  next_ = seen_ = 0;
}

double MotionMonitor::told_radps(int joint, double demand, double lever_m) const noexcept {
  const std::size_t way = demand > 0 ? 1 : 0;
  const double full = full_radps_[way][joint];
  const double rate = by_rate_ ? std::abs(demand) * full : std::abs(demand) > shut_[way][joint] ? full : 0;
  return std::copysign(rate, demand * lever_m);
}

/// What was told a lag ago, whichever way, while anything still is: who was stopped meanwhile stands rightly.
void MotionMonitor::note_unmoved(Axis& axis, bool held) const noexcept {
  const double then = axis.told_radps[(next_ + 1) % lag_steps_], now = axis.told_radps[next_];
  const bool asked = kMotion.less * std::abs(now) > kMotion.leak_radps;
  const double sure_radps = held || !asked ? 0 : kMotion.less * std::abs(then);
  Unmoved& unmoved = axis.unmoved;
  unmoved.sum_rad =
      std::clamp(unmoved.sum_rad + (sure_radps - kMotion.leak_radps) * step_s_, 0.0, kRemembered * kMotion.unmoved_rad);
  unmoved.at_rad += std::copysign(sure_radps, then) * step_s_;
  unmoved.low_rad = std::min(unmoved.low_rad, unmoved.at_rad);
  unmoved.high_rad = std::max(unmoved.high_rad, unmoved.at_rad);
}

Reason MotionMonitor::look(Axis& axis, int joint, double moved_rad, double let_in_rad, bool touched, const Held& held,
                           double missing_limit_rad, double steps_rad) noexcept {
  Reason why;
  const bool may_stand = touched || held.driven;
  if (moved_rad != 0) axis.unmoved = {};
  note_unmoved(axis, held.any);
  for (const int sign : {-1, 1}) {
    Way& way = axis.ways[sign > 0 ? 1 : 0];
    double most = 0, least = std::abs(axis.told_radps[0]);
    for (std::size_t i = 0; i < lag_steps_; ++i) {
      const double told = sign * axis.told_radps[i];
      most = std::max(most, told);
      least = std::min(least, std::max(0.0, told));
    }
    const double moved = sign * moved_rad, let_in = sign * let_in_rad,
                 most_rad = kMotion.beyond_rad[static_cast<std::size_t>(joint)];
    // Kept just above its limit, so that it is forgotten soon after the joint has come to rest.
    const double beyond_rad = std::clamp(way.beyond_rad + let_in - (kMotion.more * most + kMotion.leak_radps) * step_s_,
                                         0.0, kRemembered * most_rad);
    way.beyond_rad = held.pushed[sign > 0 ? 1 : 0] ? std::min(beyond_rad, way.beyond_rad) : beyond_rad;
    // Against the command it may swing: that is the other sum's.
    const double came = std::max(0.0, moved);
    const double missing = std::max(0.0, way.missing_rad + kMotion.less * least * step_s_ - came);
    const bool told_all_the_while = least > 0 && !may_stand;
    way.missing_rad = told_all_the_while ? missing : std::min(missing, way.missing_rad);
    if (most == 0) way.missing_rad = 0;  // nobody asks for it any more
    if (way.beyond_rad > most_rad) why = not_following(joint, way.beyond_rad, most_rad);
    if (by_rate_ && way.missing_rad > missing_limit_rad) why = not_following(joint, way.missing_rad, missing_limit_rad);
  }
  const Unmoved& unmoved = axis.unmoved;
  if (by_rate_ && !why && unmoved.sum_rad > kMotion.unmoved_rad && unmoved.high_rad - unmoved.low_rad > steps_rad)
    why = not_following(joint, unmoved.sum_rad, kMotion.unmoved_rad);
  return why;
}

Reason MotionMonitor::step(const JointVector& demand, const estimation::JointState& state, bool pressed) noexcept {
  Reason first;
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    Axis& axis = axes_[joint];
    axis.told_radps[next_] = told_radps(i, demand[i], state.lever_m[i]);
    const bool known = state.pressures_known[joint];
    const double all_let_in_rad =
        state.angle_rad[i] +
        (known ? given_way_rad(machine_, kinematics_, i, state.angle_rad[i], state.cylinder_N[i]) : 0);
    const double moved_rad = seen_ == 0 ? 0 : state.angle_rad[i] - axis.last_rad;
    const double let_in_rad = seen_ == 0 ? 0 : all_let_in_rad - axis.last_let_in_rad;
    axis.last_rad = state.angle_rad[i];
    axis.last_let_in_rad = all_let_in_rad;
    if (seen_ < lag_steps_) continue;
    const double steps_rad = kMotion.unmoved_steps * step_m_[i] / std::max(std::abs(state.lever_m[i]), kLeastLever_m);
    const double head_Pa = state.pressure_Pa[2 * joint], rod_Pa = state.pressure_Pa[2 * joint + 1];
    // What extends the cylinder pushes the oil out of its rod side.
    const bool extends_up = state.lever_m[i] > 0, in = known && head_Pa > pushed_Pa_,
               out = known && rod_Pa > pushed_Pa_;
    const Held held{known && (demand[i] > 0 ? head_Pa : rod_Pa) > held_Pa_,
                    known && std::max(head_Pa, rod_Pa) > held_Pa_,
                    {extends_up ? in : out, extends_up ? out : in}};
    const Reason why =
        look(axis, i, moved_rad, let_in_rad, pressed, held, (known ? 1 : 2) * kMotion.missing_rad, steps_rad);
    if (!first) first = why;
  }
  next_ = (next_ + 1) % lag_steps_;
  seen_ = std::min(seen_ + 1, lag_steps_);
  return first;
}

}  // namespace knuckle::slave
