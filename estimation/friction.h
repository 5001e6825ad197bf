// Cylinder friction by virtual work at the rod: Coulomb, Stribeck, load-dependent and viscous, each direction apart, on
// a Dahl state instead of the sign of the speed.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/joints.h"
#include "machine/arm_description.h"
#include "machine/calibration.h"
#include "machine/description.h"

namespace knuckle::estimation {

/// F_f, positive while extending, opposes the rod: the joint's torque is lever * (F - F_f), F the cylinder force.
///   F_f = F_o + s (F_c + F_b exp(-(v/v_s)^2) + k |F| + a (p_A + p_B)) + F_v v
/// F_c is the mean Coulomb friction of both directions, F_o half their difference, so s = +-1 gives each direction's
/// own. F_o acts at s = 0, too, because it is mostly the offset of the pressure transmitters.
struct CylinderFriction {
  double offset_N = 0;          ///< F_o
  double coulomb_N = 0;         ///< F_c
  double breakaway_N = 0;       ///< F_b = F_s - F_c
  double viscous_Ns_per_m = 0;  ///< F_v
  double stribeck_mps = 0.01;   ///< v_s
  double load_share = 0;        ///< k
  double seal_m2 = 0;           ///< a

  explicit CylinderFriction(const FrictionDescription& nominal) noexcept
      : coulomb_N(nominal.coulomb_N),
        breakaway_N(nominal.coulomb_N * (nominal.static_ratio - 1)),
        viscous_Ns_per_m(nominal.viscous_Ns_per_m),
        stribeck_mps(nominal.stribeck_mps) {}
  explicit CylinderFriction(const FrictionCalibration& found) noexcept
      : offset_N((found.coulomb_extend_N - found.coulomb_retract_N) / 2),
        coulomb_N((found.coulomb_extend_N + found.coulomb_retract_N) / 2),
        breakaway_N(found.breakaway_N),
        viscous_Ns_per_m(found.viscous_Ns_per_m),
        stribeck_mps(found.stribeck_mps),
        load_share(found.load_share),
        seal_m2(found.seal_m2) {}

  /// @param dahl in [-1, 1], see DahlState; @param cylinder_N pressure force, for the pins' share of it; @param
  /// pressure_sum_Pa p_A + p_B, for the seals'. @return F_f [N].
  [[nodiscard]] double force_N(double dahl, double extension_mps, double cylinder_N = 0,
                               double pressure_sum_Pa = 0) const noexcept {
    const double slip = extension_mps / stribeck_mps;
    return offset_N +
           dahl * (coulomb_N + breakaway_N * std::exp(-slip * slip) + loaded_N(cylinder_N, pressure_sum_Pa)) +
           viscous_Ns_per_m * extension_mps;
  }
  /// F_s [N]: the most friction that holds a rod at rest.
  [[nodiscard]] double static_N(double cylinder_N = 0, double pressure_sum_Pa = 0) const noexcept {
    return coulomb_N + breakaway_N + loaded_N(cylinder_N, pressure_sum_Pa);
  }

 private:
  [[nodiscard]] double loaded_N(double cylinder_N, double pressure_sum_Pa) const noexcept {
    return load_share * std::abs(cylinder_N) + seal_m2 * std::max(0.0, pressure_sum_Pa);
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
  /// After step(): s decays while the encoders see no motion. Behind a shut valve the links still swing on the oil by
  /// less than an encoder step, which releases the bristles. Any kSettling_s from 0.3 to 0.6 s does as well
  /// (simulated).
  double settle(double extension_mps, double step_s) noexcept {
    if (std::abs(extension_mps) < kStanding_mps) value_ *= std::exp(-step_s / kSettling_s);
    return value_;
  }
  /// The rod vibrated by so much, to and fro, about where it stands.
  void release(double way_m) noexcept { value_ *= std::exp(-way_m / kTurnDistance_m); }
  void reset() noexcept { value_ = 0; }
  [[nodiscard]] double value() const noexcept { return value_; }

 private:
  double value_ = 0;
};

// Friction of a cylinder as identified, or as drawn where it was not.

[[nodiscard]] inline CylinderFriction known_friction(const MachineDescription& machine, int joint) {
  return machine.dynamics_calibration ? CylinderFriction(machine.dynamics_calibration->friction(joint))
                                      : CylinderFriction(machine.cylinders[static_cast<std::size_t>(joint)].friction);
}

}  // namespace knuckle::estimation
