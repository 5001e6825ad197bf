#include "slave/joint_control.h"

#include <algorithm>
#include <cmath>

namespace knuckle::slave {

JointControl::JointControl(const MachineDescription& machine, double /*step_s*/) : machine_(machine) {}

JointControl::Output JointControl::step(const estimation::JointState& state, const estimation::ForceEstimate& /*force*/,
                                        const JointCommand& command, const JointVector& /*sent_valve_last*/) noexcept {
  Output out;
  if (!command.active) return out;
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const CylinderDescription& cylinder = machine_.cylinders[joint];
    const ValveDescription& valve = cylinder.valve;
    const double limit = machine_.links[joint].max_rate_radps;
    const double wanted =
        machine_.control.position_gain_1ps * (command.position_rad[i] - state.angle_rad[i]) + command.velocity_radps[i];
    out.rate_radps[i] = std::clamp(wanted, -limit, limit);
    const double speed = state.lever_m[i] * out.rate_radps[i];  // of the cylinder
    const double opening = std::clamp(speed * cylinder.head_area_m2() / valve.nominal_flow_m3ps, -1.0, 1.0);
    const double dead_band = opening > 0 ? valve.dead_band_extend : valve.dead_band_retract;
    const double fade = std::clamp(std::abs(speed) / 0.002, 0.0, 1.0);
    out.valve[i] = std::clamp(opening + std::copysign(dead_band * fade, opening), -1.0, 1.0);
  }
  return out;
}

void JointControl::reset() noexcept {}

}  // namespace knuckle::slave
