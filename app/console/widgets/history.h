// The last ten seconds of a few signals, for plots.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "app/console/console_view.h"
#include "machine/kinematics.h"

namespace knuckle::console::widgets {

/// Speed at which a joint's cylinder extends; zero where it is not known.
[[nodiscard]] double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept;

/// Fixed room; sampled on the loops' own time, so it stops with a paused session.
class History {
 public:
  static constexpr double kSpan_s = 10, kStep_s = 0.05;
  static constexpr std::size_t kSamples = 201;

  static constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  struct Sample {
    PerJoint<float> command = unknown(), spool = unknown(), cylinder_mps = unknown();  ///< Positive: extends.
    float hand_energy_J = kUnknown;
    float tip_force_N = kUnknown;
  };

  /// Takes a sample when one is due; restarts with the session. What is not received, or was not looked at, is
  /// unknown.
  /// @param machine_known, @param status_known whether the view's machine and status are fresh.
  void watch(const ConsoleView& view, const Kinematics& kinematics, bool machine_known, bool status_known);
  /// One sample of a view, whether or not one is due.
  [[nodiscard]] static Sample sample_of(const ConsoleView& view, const Kinematics& kinematics, bool machine_known,
                                        bool status_known);
  /// These instead of what was there; the oldest first.
  void set(const std::array<Sample, kSamples>& samples) noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// 0: the newest.
  [[nodiscard]] const Sample& ago(std::size_t steps) const noexcept {
    return samples_[(next_ + kSamples - 1 - steps) % kSamples];
  }

 private:
  static constexpr PerJoint<float> unknown() { return {kUnknown, kUnknown, kUnknown}; }
  void add(const Sample& sample) noexcept;

  std::array<Sample, kSamples> samples_{};
  std::size_t next_ = 0, count_ = 0;
  std::int64_t last_ = -1;  ///< Number of the newest sample's step since the session began.
};

}  // namespace knuckle::console::widgets
