// Joints that move at random, each by itself, anywhere in their ranges and to the ends: what free air is judged with.
#pragma once

#include <random>

#include "core/joints.h"

namespace knuckle::sim {

/// Every stretch is of minimum jerk (Flash and Hogan 1985), begins and ends at rest, and is followed by a pause.
class Wander {
 public:
  /// @param low_rad, @param high_rad the joints' ranges.
  Wander(std::uint64_t seed, const JointVector& low_rad, const JointVector& high_rad);

  /// Begins anew, with other numbers than before. @param fastest_radps peak speed of the fastest stretch.
  void begin(const JointVector& from_rad, double fastest_radps) noexcept;
  /// @param t_s since the beginning, never going back. @param going_on new stretches may begin.
  /// @return where the joints are meant to be.
  const JointVector& step(double t_s, bool going_on) noexcept;
  /// Nothing is on its way.
  [[nodiscard]] bool at_rest() const noexcept { return at_rest_; }

 private:
  struct Stretch {
    double from_rad = 0, to_rad = 0, begin_s = 0, end_s = 0, until_s = 0;  // the last: of the pause
  };
  [[nodiscard]] Stretch drawn(int joint, double from_rad, double t_s) noexcept;

  std::mt19937_64 random_;
  JointVector low_rad_, high_rad_, meant_rad_ = JointVector::Zero();
  double fastest_radps_ = 0;
  PerJoint<Stretch> stretches_{};
  bool at_rest_ = true;
};

}  // namespace knuckle::sim
