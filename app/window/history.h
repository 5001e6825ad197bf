// The last ten seconds of a few signals, for plots.
#pragma once

#include <array>
#include <cstddef>

#include "app/console/console_view.h"
#include "machine/kinematics.h"

namespace knuckle::app {

/// Speed at which a joint's cylinder extends; what cannot be told is none.
[[nodiscard]] double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept;

/// Fixed room; sampled on the loops' own time, so a paused session stands still.
class History {
 public:
  static constexpr double kSpan_s = 10, kStep_s = 0.05;
  static constexpr std::size_t kSamples = 201;

  struct Sample {
    PerJoint<float> command{}, spool{}, cylinder_mps{};  ///< All positive where the cylinder extends.
    float flow_m3ps = 0, power_W = 0, round_trip_s = 0, force_N = 0, hand_energy_J = 0;
  };

  /// Takes a sample when one is due; begins anew when the session did.
  void watch(const ConsoleView& view, const Kinematics& kinematics);
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// 0: the newest.
  [[nodiscard]] const Sample& ago(std::size_t steps) const noexcept {
    return samples_[(next_ + kSamples - 1 - steps) % kSamples];
  }

 private:
  std::array<Sample, kSamples> samples_{};
  std::size_t next_ = 0, count_ = 0;
  Time last_ = kNever;
};

}  // namespace knuckle::app
