// A few signals of late, for plots: ten seconds of them, or all that is kept of a session that runs.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "app/console/console_view.h"
#include "machine/kinematics.h"

namespace knuckle::console::widgets {

/// Speed at which a joint's cylinder extends; zero where it is not known.
[[nodiscard]] double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept;

/// Fixed room; sampled on the loops' own time, so it stops with a paused session.
class History {
 public:
  /// @param kept samples.
  explicit History(std::size_t kept = kSamples) : samples_(kept) {}

  static constexpr double kSpan_s = 10, kStep_s = 0.05;
  static constexpr std::size_t kSamples = 201;

  static constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  struct Sample {
    PerJoint<float> command = unknown(), spool = unknown(), cylinder_mps = unknown();  ///< Positive: extends.
    float hand_energy_J = kUnknown;
    float tip_force_N = kUnknown;
    /// Head and rod side of each cylinder.
    std::array<float, 2 * kJoints> pressure_Pa = {kUnknown, kUnknown, kUnknown, kUnknown, kUnknown, kUnknown};
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
  /// Of this step of kStep_s since the session began; nullptr: not kept.
  [[nodiscard]] const Sample* of_step(std::int64_t step) const noexcept;
  [[nodiscard]] static std::int64_t step_of(Time at) noexcept { return at.time_since_epoch() / from_seconds(kStep_s); }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// 0: the newest.
  [[nodiscard]] const Sample& ago(std::size_t steps) const noexcept {
    return samples_[(next_ + samples_.size() - 1 - steps) % samples_.size()];
  }

 private:
  static constexpr PerJoint<float> unknown() { return {kUnknown, kUnknown, kUnknown}; }
  void add(const Sample& sample) noexcept;

  std::vector<Sample> samples_;
  std::size_t next_ = 0, count_ = 0;
  std::int64_t last_ = -1;  ///< Number of the newest sample's step since the session began.
};

}  // namespace knuckle::console::widgets
