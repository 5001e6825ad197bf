// One valve spool: transport delay, hysteresis of the magnet, stiction, second-order motion with a speed limit, dead
// bands, and the curve of its edges.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "machine/arm_description.h"
#include "sim/truth.h"

namespace knuckle::sim {

class Spool {
 public:
  Spool(const ValveDescription& valve, const ValveRoughness& rough, double substep_s) noexcept
      : valve_(valve),
        rough_(rough),
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

  /// One substep; without pilot the spring centres the spool. @param warmth_K of the oil over the start.
  void advance(bool pilot, double warmth_K) noexcept {
    line_[now_ % kLine] = demand_;
    const double delayed = now_ >= delay_ ? line_[(now_ - delay_) % kLine] : 0;
    ++now_;
    const double half = valve_.hysteresis / 2;
    played_ = std::clamp(played_, delayed - half, delayed + half);
    const double target = unstuck(pilot ? played_ + rough_.null_drift_per_K * warmth_K : 0);
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
  /// sgn(x) max(0, |x| - dead band) / (1 - dead band), then the edge's curve.
  [[nodiscard]] double opening() const noexcept {
    if (position_ > valve_.dead_band_extend) {
      return curve((position_ - valve_.dead_band_extend) / (1 - valve_.dead_band_extend));
    }
    if (position_ < -valve_.dead_band_retract) {
      return -rough_.retract_gain * curve((-position_ - valve_.dead_band_retract) / (1 - valve_.dead_band_retract));
    }
    return 0;
  }

 private:
  /// Share of the edge's area: a notch, then the whole land, then the exponent.
  [[nodiscard]] double curve(double opening) const noexcept {
    const double notch = rough_.notch_opening, area = rough_.notch_slope * notch;
    const double cut = opening < notch ? rough_.notch_slope * opening
                                       : area + (1 - area) * (opening - notch) / std::max(1e-9, 1 - notch);
    return rough_.curve_exponent == 1 ? cut : std::pow(cut, rough_.curve_exponent);
  }
  /// Where a spool that sticks lets itself be driven to.
  [[nodiscard]] double unstuck(double target) noexcept {
    if (rough_.stiction <= 0) return target;
    if (stuck_ && std::abs(target - held_) <= rough_.stiction) return held_;
    held_ = target;
    stuck_ = std::abs(position_ - target) < 0.1 * rough_.stiction && std::abs(rate_) < 0.1;
    return target;
  }

  static constexpr std::uint64_t kLine = 1024;  // 0.25 s of substeps
  ValveDescription valve_;
  ValveRoughness rough_;
  double held_ = 0;
  bool stuck_ = false;
  double substep_s_;
  std::uint64_t delay_, now_ = 0;
  double max_rate_;
  double a_xx_, a_xv_, a_vx_, a_vv_;
  double demand_ = 0, played_ = 0, position_ = 0, rate_ = 0;
  std::array<double, kLine> line_{};
};

}  // namespace knuckle::sim
