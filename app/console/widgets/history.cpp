#include "app/console/widgets/history.h"

#include <algorithm>

namespace knuckle::console::widgets {

double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept {
  const auto cylinder = kinematics.cylinder_at(joint, machine.position_rad[joint]);
  return cylinder ? cylinder->lever_m * machine.velocity_radps[joint] : 0;
}

void History::add(const Sample& sample) noexcept {
  samples_[next_] = sample;
  next_ = (next_ + 1) % kSamples;
  count_ = std::min(count_ + 1, kSamples);
}

History::Sample History::sample_of(const ConsoleView& view, const Kinematics& kinematics, bool machine_known,
                                   bool status_known) {
  Sample s;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto axis = static_cast<Eigen::Index>(j);
    if (status_known) s.command[j] = static_cast<float>(view.status.valve_command[axis]);
    if (status_known) s.spool[j] = static_cast<float>(view.status.spool[axis]);
    if (machine_known)
      s.cylinder_mps[j] = static_cast<float>(cylinder_speed_mps(kinematics, view.machine, static_cast<int>(j)));
  }
  if (machine_known) s.tip_force_N = static_cast<float>(view.machine.tip_force_N.norm());
  s.hand_energy_J = static_cast<float>(view.hand.hand_energy_J);
  return s;
}

void History::set(const std::array<Sample, kSamples>& samples) noexcept {
  samples_ = samples;
  next_ = 0;
  count_ = kSamples;
}

void History::watch(const ConsoleView& view, const Kinematics& kinematics, bool machine_known, bool status_known) {
  constexpr std::int64_t kHeld = 4;  // steps that a window which draws slowly may hold a value
  const std::int64_t step = view.now.time_since_epoch() / from_seconds(kStep_s);
  if (step < last_) *this = History();
  if (step == last_) return;
  const Sample s = sample_of(view, kinematics, machine_known, status_known);
  const std::int64_t steps = last_ < 0 ? 1 : std::min<std::int64_t>(step - last_, kSamples);
  for (std::int64_t i = 1; i < steps; ++i) add(steps > kHeld ? Sample{} : s);
  add(s);
  last_ = step;
}

}  // namespace knuckle::console::widgets
