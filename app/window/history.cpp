#include "app/window/history.h"

#include <algorithm>

namespace knuckle::app {

double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept {
  const auto cylinder = kinematics.cylinder_at(joint, machine.position_rad[joint]);
  return cylinder ? cylinder->lever_m * machine.velocity_radps[joint] : 0;
}

void History::watch(const ConsoleView& view, const Kinematics& kinematics) {
  if (view.now < last_) count_ = 0;
  if (last_ != kNever && view.now >= last_ && to_seconds(view.now - last_) < kStep_s) return;
  last_ = view.now;
  Sample& s = samples_[next_];
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto axis = static_cast<Eigen::Index>(j);
    s.command[j] = static_cast<float>(view.status.valve_command[axis]);
    s.spool[j] = static_cast<float>(view.status.spool[axis]);
    s.cylinder_mps[j] = static_cast<float>(cylinder_speed_mps(kinematics, view.machine, static_cast<int>(j)));
  }
  s.flow_m3ps = static_cast<float>(view.status.oil_flow_m3ps);
  s.power_W = static_cast<float>(view.status.hydraulic_power_W);
  s.round_trip_s = static_cast<float>(view.link.round_trip_s);
  s.force_N = static_cast<float>(view.machine.tip_force_N.norm());
  s.hand_energy_J = static_cast<float>(view.hand.hand_energy_J);
  next_ = (next_ + 1) % kSamples;
  count_ = std::min(count_ + 1, kSamples);
}

}  // namespace knuckle::app
