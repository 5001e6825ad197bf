// What stands in for spools that do not tell their places: where they should be by the pilot pressures that move them,
// where the machine measures these, else by what they were told.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/joints.h"
#include "machine/description.h"
#include "machine/pilot_spool.h"

namespace knuckle::slave {

/// Pressures behind the lag that the machine file gives the valves; commands also behind their delay, and a period of
/// the frames that tell them.
class UnseenSpool {
 public:
  UnseenSpool(const MachineDescription& machine, double step_s) noexcept {
    demands_.fill(JointVector::Zero());
    for (std::size_t i = 0; i < kJoints; ++i) {
      const ValveDescription& valve = machine.cylinders[i].valve;
      by_pressure_[i] = tells_pilots(machine.bus, static_cast<int>(i));
      const double delay_s = by_pressure_[i] ? 0 : valve.delay_s + machine.bus.joint_period_s();
      delay_[i] = std::min(kSlots - 1, static_cast<std::size_t>(std::lround(delay_s / step_s)));
      // A second-order lag has the delay 2 zeta / omega.
      const double lag_s = valve.damping_ratio / (std::numbers::pi * valve.natural_frequency_Hz);
      share_[static_cast<int>(i)] = 1 - std::exp(-step_s / lag_s);
    }
  }
  /// What was told has come to nothing; pressures still tell.
  void forget_commands() noexcept {
    demands_.fill(JointVector::Zero());
    for (int i = 0; i < kJoints; ++i)
      if (!by_pressure_[static_cast<std::size_t>(i)]) spool_[i] = 0;
  }
  /// @param demand as on the wire, [-1, 1] @param piloted PilotSpool::position() of the joints that tell it
  const JointVector& step(const JointVector& demand, const JointVector& piloted) noexcept {
    for (int i = 0; i < kJoints; ++i)
      demands_[next_][i] = by_pressure_[static_cast<std::size_t>(i)] ? piloted[i] : demand[i];
    for (int i = 0; i < kJoints; ++i) {
      const std::size_t then = (next_ + kSlots - delay_[static_cast<std::size_t>(i)]) % kSlots;
      spool_[i] += share_[i] * (demands_[then][i] - spool_[i]);
    }
    next_ = (next_ + 1) % kSlots;
    return spool_;
  }
  [[nodiscard]] const JointVector& value() const noexcept { return spool_; }

 private:
  static constexpr std::size_t kSlots = 32;  // 125 ms at 250 Hz
  PerJoint<bool> by_pressure_{};
  PerJoint<std::size_t> delay_{};
  JointVector share_ = JointVector::Zero(), spool_ = JointVector::Zero();
  std::array<JointVector, kSlots> demands_;
  std::size_t next_ = 0;
};

}  // namespace knuckle::slave
