#include "app/console/widgets/history.h"

#include <algorithm>

#include "app/console/machine_words.h"

namespace knuckle::console::widgets {

double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept {
  const auto cylinder = kinematics.cylinder_at(joint, machine.position_rad[joint]);
  return cylinder ? cylinder->lever_m * machine.velocity_radps[joint] : 0;
}

void History::add(const Sample& sample) noexcept {
  samples_[next_] = sample;
  next_ = (next_ + 1) % samples_.size();
  count_ = std::min(count_ + 1, samples_.size());
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
  if (machine_known && force_words(view).known) s.tip_force_N = static_cast<float>(view.machine.tip_force_N.norm());
  for (std::size_t i = 0; machine_known && i < s.pressure_Pa.size(); ++i)
    s.pressure_Pa[i] = static_cast<float>(view.machine.pressure_Pa[i]);
  s.hand_energy_J = static_cast<float>(view.hand.hand_energy_J);
  return s;
}

void History::set(const std::array<Sample, kSamples>& samples) noexcept {
  samples_.assign(samples.begin(), samples.end());
  next_ = 0;
  count_ = kSamples;
}

const History::Sample* History::of_step(std::int64_t step) const noexcept {
  const std::int64_t steps = last_ - step;
  return steps < 0 || steps >= static_cast<std::int64_t>(count_) ? nullptr : &ago(static_cast<std::size_t>(steps));
}

void History::watch(const ConsoleView& view, const Kinematics& kinematics, bool machine_known, bool status_known) {
  constexpr std::int64_t kHeld = 4;  // steps that a window which draws slowly may hold a value
  const std::int64_t step = step_of(view.now);
  if (step < last_) *this = History(samples_.size());
  if (step == last_) return;
  const Sample s = sample_of(view, kinematics, machine_known, status_known);
  const std::int64_t steps = last_ < 0 ? 1 : std::min(step - last_, static_cast<std::int64_t>(samples_.size()));
  for (std::int64_t i = 1; i < steps; ++i) add(steps > kHeld ? Sample{} : s);
  add(s);
  last_ = step;
}

}  // namespace knuckle::console::widgets
