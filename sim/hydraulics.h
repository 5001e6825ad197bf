// Oil: orifice, compressibility, and the constants of one axis and of the pump. Pressures are over atmosphere.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "machine/arm_description.h"
#include "sim/truth.h"

namespace knuckle::sim {

inline constexpr double kLaminarDrop_Pa = 2e5;  ///< Smooths the orifice at zero; smaller is too stiff at stall.
inline constexpr double kReliefLag_s = 0.01;
inline constexpr double kReliefOverride = 0.05;  ///< Fully open at 1.05 of the setting.
inline constexpr double kPumpVolume_m3 = 1e-3;   ///< Between pump and valves.
inline constexpr double kPumpDroop_Pa = 5e5;     ///< Regulator: no flow to full flow.
inline constexpr double kVapour_Pa = -0.9e5;

/// Flow per unit of K o: dp / (dp^2 + dp_lam^2)^(1/4), odd and smooth.
[[nodiscard]] inline double orifice(double drop_Pa) noexcept {
  return drop_Pa / std::sqrt(std::sqrt(drop_Pa * drop_Pa + kLaminarDrop_Pa * kLaminarDrop_Pa));
}

/// Its derivative by the drop.
[[nodiscard]] inline double orifice_slope(double drop_Pa) noexcept {
  const double drop2 = drop_Pa * drop_Pa, sum = drop2 + kLaminarDrop_Pa * kLaminarDrop_Pa, root = std::sqrt(sum);
  return (0.5 * drop2 + kLaminarDrop_Pa * kLaminarDrop_Pa) / (sum * std::sqrt(root));
}

/// Effective bulk modulus with entrained air, 1 / beta = (1 + 15 (p_a / (p + p_a))^3) / beta_0 with p_a = 6 bar:
/// 84 % of beta_0 at 20 bar, 29 % at 5 bar; its energy of compression has a closed form without a logarithm.
struct Oil {
  static constexpr double kAir_Pa = 6e5, kAirShare = 15;
  double bulk_modulus_Pa = 1e9;
  /// Pressure rate of a volume [Pa/s] where net oil flows in.
  [[nodiscard]] double pressure_rate(double p, double flow_m3ps, double volume_m3) const noexcept {
    constexpr double air = kAirShare * kAir_Pa * kAir_Pa * kAir_Pa;
    const double y = std::max(p, 0.0) + kAir_Pa;
    const double y3 = y * y * y;
    return bulk_modulus_Pa * y3 * flow_m3ps / ((y3 + air) * volume_m3);
  }
  /// Energy of compression per volume: integral of p / beta(p) from 0.
  [[nodiscard]] double energy_density(double p) const noexcept {
    const double part = kAir_Pa / (std::max(p, 0.0) + kAir_Pa);
    return 0.5 * p * p * (1 + kAirShare * part * part) / bulk_modulus_Pa;
  }
};

/// One cylinder with its valve, ready to evaluate.
struct AxisConstants {
  double head_area_m2, rod_area_m2, min_length_m, max_length_m;
  double valve_gain;  ///< K = Q_nom / sqrt(dp_nom)
  AxisConstants() = default;
  explicit AxisConstants(const CylinderDescription& cylinder) noexcept
      : head_area_m2(cylinder.head_area_m2()),
        rod_area_m2(cylinder.rod_side_area_m2()),
        min_length_m(cylinder.min_length_m),
        max_length_m(cylinder.max_length_m),
        valve_gain(cylinder.valve.nominal_flow_m3ps / std::sqrt(cylinder.valve.nominal_drop_Pa)) {}
};

// One valve spool: transport delay, hysteresis of the magnet, stiction, second-order motion with a speed limit, dead
// bands, and the curve of its edges.

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
