// Oil: orifice, compressibility, and the constants of one axis and of the pump. Pressures are over atmosphere.
#pragma once

#include <algorithm>
#include <cmath>

#include "machine/arm_description.h"

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

}  // namespace knuckle::sim
