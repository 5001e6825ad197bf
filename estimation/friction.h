// Cylinder friction by virtual work at the rod: Coulomb, Stribeck and viscous, each direction apart, on a Dahl state
// instead of the sign of the speed.
#pragma once

#include <cmath>

#include "core/joints.h"
#include "machine/description.h"

namespace knuckle::estimation {

/// Friction of one direction of motion.
struct DirectionFriction {
  double coulomb_N = 0;         ///< F_c
  double static_N = 0;          ///< F_s
  double viscous_Ns_per_m = 0;  ///< F_v
};

/// F_f opposes the rod: the joint feels lever * (cylinder force - F_f). Positive while extending.
struct CylinderFriction {
  DirectionFriction extend, retract;
  double stribeck_mps = 0.01;  ///< v_s

  explicit CylinderFriction(const FrictionDescription& nominal) noexcept
      : extend{nominal.coulomb_N, nominal.coulomb_N * nominal.static_ratio, nominal.viscous_Ns_per_m},
        retract(extend),
        stribeck_mps(nominal.stribeck_mps) {}

  [[nodiscard]] const DirectionFriction& towards(double extension_mps) const noexcept {
    return extension_mps >= 0 ? extend : retract;
  }
  /// @param dahl in [-1, 1], see DahlState. @return F_f [N].
  [[nodiscard]] double force_N(double dahl, double extension_mps) const noexcept {
    const DirectionFriction& f = towards(extension_mps);
    const double slip = extension_mps / stribeck_mps;
    return dahl * (f.coulomb_N + (f.static_N - f.coulomb_N) * std::exp(-slip * slip)) +
           f.viscous_Ns_per_m * extension_mps;
  }
};

/// Replaces sgn(v): the seal's bristles turn round over a distance, not at once.
/// ds/dt = v / x_c (1 - s sgn v), integrated exactly for a speed held over the step.
class DahlState {
 public:
  static constexpr double kTurnDistance_m = 1e-4;  ///< x_c
  static constexpr double kStanding_mps = 5e-4, kSettling_s = 0.5;
  double step(double extension_mps, double step_s) noexcept {
    const double target = extension_mps >= 0 ? 1.0 : -1.0;
    value_ = target + (value_ - target) * std::exp(-std::abs(extension_mps) * step_s / kTurnDistance_m);
    return value_;
  }
  /// After step(), where encoders see no motion: valve shut, the links still ring on the oil by less than an encoder
  /// step, which shakes the bristles loose. Measured on simulated machines: anything from 0.3 to 0.6 s does as well.
  double settle(double extension_mps, double step_s) noexcept {
    if (std::abs(extension_mps) < kStanding_mps) value_ *= std::exp(-step_s / kSettling_s);
    return value_;
  }
  void reset() noexcept { value_ = 0; }
  [[nodiscard]] double value() const noexcept { return value_; }

 private:
  double value_ = 0;
};

}  // namespace knuckle::estimation
