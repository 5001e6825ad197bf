// One valve spool: transport delay, hysteresis of the magnet, second-order motion with a speed limit, dead bands.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "machine/arm_description.h"

namespace knuckle::sim {

class Spool {
 public:
  Spool(const ValveDescription& valve, double substep_s) noexcept
      : valve_(valve),
        substep_s_(substep_s),
        delay_(static_cast<std::uint64_t>(std::lround(valve.delay_s / substep_s))),
        max_rate_(valve.full_stroke_s > 0 ? 1 / valve.full_stroke_s : 1e3) {
    // Exact transition of x'' = w^2 (u - x) - 2 zeta w x' for an input held over the substep; just short of critical
    // damping one form serves every damping ratio up to 1, larger ones are capped there.
    const double w = 2 * std::numbers::pi * valve.natural_frequency_Hz;
    const double zeta = std::min(valve.damping_ratio, 0.9999);
    const double wd = w * std::sqrt(1 - zeta * zeta);
    const double decay = std::exp(-zeta * w * substep_s);
    const double c = std::cos(wd * substep_s), s = std::sin(wd * substep_s) / wd;
    a_xx_ = decay * (c + zeta * w * s);
    a_xv_ = decay * s;
    a_vx_ = -decay * w * w * s;
    a_vv_ = decay * (c - zeta * w * s);
  }

  void demand(double value) noexcept { demand_ = value; }

  /// One substep; without pilot the spring centres the spool.
  void advance(bool pilot) noexcept {
    line_[now_ % kLine] = demand_;
    const double delayed = now_ >= delay_ ? line_[(now_ - delay_) % kLine] : 0;
    ++now_;
    const double half = valve_.hysteresis / 2;
    played_ = std::clamp(played_, delayed - half, delayed + half);
    const double target = pilot ? played_ : 0;
    const double error = position_ - target;
    const double next = target + a_xx_ * error + a_xv_ * rate_;
    rate_ = std::clamp(a_vx_ * error + a_vv_ * rate_, -max_rate_, max_rate_);
    position_ = std::clamp(next, position_ - max_rate_ * substep_s_, position_ + max_rate_ * substep_s_);
    if (std::abs(position_) >= 1) {
      position_ = std::copysign(1.0, position_);
      rate_ = 0;
    }
  }

  [[nodiscard]] double position() const noexcept { return position_; }
  /// sgn(x) max(0, |x| - dead band) / (1 - dead band)
  [[nodiscard]] double opening() const noexcept {
    if (position_ > valve_.dead_band_extend) {
      return (position_ - valve_.dead_band_extend) / (1 - valve_.dead_band_extend);
    }
    if (position_ < -valve_.dead_band_retract) {
      return (position_ + valve_.dead_band_retract) / (1 - valve_.dead_band_retract);
    }
    return 0;
  }

 private:
  static constexpr std::uint64_t kLine = 1024;  // 0.25 s of substeps
  ValveDescription valve_;
  double substep_s_;
  std::uint64_t delay_, now_ = 0;
  double max_rate_;
  double a_xx_, a_xv_, a_vx_, a_vv_;
  double demand_ = 0, played_ = 0, position_ = 0, rate_ = 0;
  std::array<double, kLine> line_{};
};

}  // namespace knuckle::sim
