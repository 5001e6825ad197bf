// Joint paths put together from moves and stops: every move starts and ends at rest (minimum jerk).
#pragma once

#include <algorithm>
#include <cmath>

#include "core/joints.h"
#include "estimation/identification/excitation.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::motion {

class PathBuilder {
 public:
  PathBuilder(const JointVector& start_rad, double step_s) : at_(start_rad) {
    path_.step_s = step_s;
    path_.joint_rad.push_back(start_rad);
  }

  void hold(double duration_s) { path_.joint_rad.insert(path_.joint_rad.end(), samples(duration_s), at_); }
  static constexpr double kPeak = 1.875;  ///< A move's fastest moment over its mean speed.
  /// Quintic 10 s^3 - 15 s^4 + 6 s^5.
  void move(const JointVector& to_rad, double duration_s) {
    const std::size_t n = std::max<std::size_t>(1, samples(duration_s));
    for (std::size_t i = 1; i <= n; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(n);
      path_.joint_rad.emplace_back(at_ + s * s * s * (10 - 15 * s + 6 * s * s) * (to_rad - at_));
    }
    at_ = to_rad;
  }
  [[nodiscard]] std::size_t size() const noexcept { return path_.joint_rad.size(); }
  [[nodiscard]] const JointVector& at() const noexcept { return at_; }
  [[nodiscard]] const estimation::JointPath& path() const noexcept { return path_; }

 private:
  [[nodiscard]] std::size_t samples(double duration_s) const noexcept {
    return static_cast<std::size_t>(std::lround(duration_s / path_.step_s));
  }

  estimation::JointPath path_;
  JointVector at_;
};

/// A gentle way from pose to pose.
/// All joints together along a quintic, at rest at both ends, slow enough for every joint, the pump and the tip to keep
/// well below what they can do.
[[nodiscard]] estimation::JointPath transfer(const MachineDescription& machine, const Kinematics& kinematics,
                                             const JointVector& from_rad, const JointVector& to_rad, double step_s);

}  // namespace knuckle::motion
