// Does the spool follow its demand? Independent of the enable node, which watches the same on the bus.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/joints.h"
#include "core/reason.h"

namespace knuckle::slave {

/// A spool lags its demand by its delay and dynamics, so it is compared with all demands of the last 100 ms: outside
/// their span by more than 10 % of stroke for 100 ms is a valve that does not follow, however fast the demand moves.
class ValveMonitor {
 public:
  static constexpr double kTolerance = 0.10;  ///< of stroke
  static constexpr double kWindow_s = 0.10;   ///< delay up to 30 ms, closing 60 ms
  static constexpr double kPatience_s = 0.10;

  explicit ValveMonitor(double step_s, double tolerance = kTolerance, double patience_s = kPatience_s) noexcept
      : step_s_(step_s),
        tolerance_(tolerance),
        patience_s_(patience_s),
        used_(std::clamp<std::size_t>(static_cast<std::size_t>(kWindow_s / step_s), 1, kSlots)) {
    reset();
  }
  void reset() noexcept {
    demands_.fill(JointVector::Zero());
    apart_s_ = {};
  }

  /// @param demand as on the wire, @param spool actual; both [-1, 1]. @return kValveNotFollowing with the joint.
  [[nodiscard]] Reason step(const JointVector& demand, const JointVector& spool) noexcept {
    demands_[next_] = demand;
    next_ = (next_ + 1) % used_;
    Reason first;
    for (int i = 0; i < kJoints; ++i) {
      double low = demand[i], high = demand[i];
      for (std::size_t k = 0; k < used_; ++k) {
        low = std::min(low, demands_[k][i]);
        high = std::max(high, demands_[k][i]);
      }
      const double apart = std::max({0.0, low - spool[i], spool[i] - high});
      double& apart_s = apart_s_[static_cast<std::size_t>(i)];
      apart_s = apart > tolerance_ ? apart_s + step_s_ : 0;
      if (apart_s < patience_s_ || first) continue;
      first = {ReasonCode::kValveNotFollowing, i, apart, tolerance_};
    }
    return first;
  }

  /// The joint whose spool has been apart for half that time: the enable node may be quicker. -1: none.
  [[nodiscard]] int suspect() const noexcept {
    const auto is = [this](double apart_s) { return apart_s >= patience_s_ / 2; };
    const auto first = std::find_if(apart_s_.begin(), apart_s_.end(), is);
    return first == apart_s_.end() ? -1 : static_cast<int>(first - apart_s_.begin());
  }

 private:
  static constexpr std::size_t kSlots = 64;  // 100 ms at up to 640 Hz
  double step_s_, tolerance_, patience_s_;
  std::size_t used_, next_ = 0;
  std::array<JointVector, kSlots> demands_;
  PerJoint<double> apart_s_{};
};

}  // namespace knuckle::slave
