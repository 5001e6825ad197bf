#include "slave/pilot_monitor.h"

#include <algorithm>
#include <cmath>

#include "machine/pilot_spool.h"

namespace knuckle::slave {
PilotMonitor::PilotMonitor(const MachineDescription& machine, double step_s)
    : valves_{machine.cylinders[kBoom].valve, machine.cylinders[kArm].valve, machine.cylinders[kBucket].valve},
      step_s_(step_s),
      by_rate_(machine.bus.command_kind == CommandKind::kJointRate),
      monitor_(step_s, kPilotLimits.tolerance, kPilotLimits.patience_s) {
  for (int joint = 0; joint < kJoints; ++joint)
    told_[static_cast<std::size_t>(joint)] = tells_pilots(machine.bus, joint);
}

void PilotMonitor::reset() noexcept {
  monitor_.reset();
  ways_ = {};
}

/// @param demand, opening of this direction; neither below 0.
Reason PilotMonitor::look(Way& way, int joint, double demand, double opening) const noexcept {
  const auto lasts = [this](double& time_s, bool holds) { time_s = holds ? time_s + step_s_ : 0; };
  lasts(way.unasked_s, demand < kPilotLimits.asked);
  lasts(way.open_s, opening > kPilotLimits.tolerance);
  lasts(way.fast_s, demand >= kPilotLimits.fast);
  lasts(way.shut_s, opening <= 0);
  if (way.unasked_s > kPilotLimits.lag_s && way.open_s > kPilotLimits.unasked_s)
    return {ReasonCode::kValveNotFollowing, joint, opening, kPilotLimits.tolerance};
  if (way.fast_s > kPilotLimits.lag_s && way.shut_s > kPilotLimits.shut_s)
    return {ReasonCode::kValveNotFollowing, joint, demand, kPilotLimits.fast};
  return {};
}

Reason PilotMonitor::step(const JointVector& demand, const JointVector& opening) noexcept {
  JointVector asked = JointVector::Zero(), seen = JointVector::Zero();
  Reason first;
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    if (!told_[joint]) continue;
    asked[i] = std::copysign(valves_[joint].opening(demand[i]), demand[i]);
    seen[i] = opening[i];
    for (const int sign : {-1, 1}) {
      if (!by_rate_) break;
      const double asks = std::max(0.0, sign * demand[i]), opens = std::max(0.0, sign * opening[i]);
      const Reason why = look(ways_[joint][sign > 0 ? 1 : 0], i, asks, opens);
      if (!first) first = why;
    }
  }
  return by_rate_ ? first : monitor_.step(asked, seen);
}

}  // namespace knuckle::slave
