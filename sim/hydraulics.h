// Oil: orifice, compressibility, and the constants of one axis and of the pump. Pressures are over atmosphere.
#pragma once

#include <algorithm>
#include <cmath>

#include "machine/description.h"

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

/// Effective bulk modulus with entrained air: beta0 (p^2 + p1^2) / (p^2 + p2^2), 87 % at 20 bar, a third at 5 bar.
struct Oil {
  static constexpr double kAirLow_Pa = 2e5, kAirHigh_Pa = 8e5;
  double bulk_modulus_Pa = 1e9;
  [[nodiscard]] double stiffness(double p) const noexcept {
    const double square = p > 0 ? p * p : 0;
    return bulk_modulus_Pa * (square + kAirLow_Pa * kAirLow_Pa) / (square + kAirHigh_Pa * kAirHigh_Pa);
  }
  /// Energy of compression per volume: integral of p / beta(p) from 0.
  [[nodiscard]] double energy_density(double p) const noexcept {
    if (p <= 0) return 0.5 * p * p / stiffness(0);
    const double low2 = kAirLow_Pa * kAirLow_Pa, high2 = kAirHigh_Pa * kAirHigh_Pa;
    return (0.5 * p * p + 0.5 * (high2 - low2) * std::log1p(p * p / low2)) / bulk_modulus_Pa;
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

}  // namespace knuckle::sim
