// The hull on its tracks on compliant ground: heave and pitch about the middle of the tracks, held by a spring and
// damper at either end that push and never pull (so it rocks, and tips), and that sink for good where they are
// overloaded.
#pragma once

#include <array>

#include "sim/rigid_body.h"
#include "sim/truth.h"

namespace knuckle::sim {

/// Heave is upwards in W, pitch is over the pitch at the start.
struct HullState {
  double heave_m = 0, pitch_rad = 0, heave_mps = 0, pitch_radps = 0;
};

/// What the ground carries at rest: upwards, and about the tracks' middle. @return its pushes on their rear and front
/// end, frame W; negative where the machine would tip.
[[nodiscard]] std::array<double, 2> pushes_at_rest_N(const HullTruth& hull, double heave_N, double pitch_Nm) noexcept;

class Hull {
 public:
  /// Pushes of the ground on the tracks' ends, frame W, and what the springs store.
  struct Ground {
    std::array<double, 2> push_N{};  ///< rear, front
    double heave_N = 0, pitch_Nm = 0;
    double stored_J = 0, lost_W = 0;
  };

  Hull(const HullTruth& truth, double start_pitch_rad);

  /// False: the hull stands like a rock, and nothing here is asked.
  [[nodiscard]] bool compliant() const noexcept { return truth_.stiffness_N_per_m > 0; }
  /// M to W.
  [[nodiscard]] Turn turn(const HullState& s) const noexcept { return Turn(start_pitch_rad_ + s.pitch_rad); }
  /// Boom pin (origin of M), frame W; it is at W's origin at the start.
  [[nodiscard]] PlanarVector pin_m(const HullState& s) const noexcept {
    return PlanarVector(0, s.heave_m) + turn(s) * from_centre_ - pin_start_m_;
  }
  [[nodiscard]] PlanarVector pin_mps(const HullState& s) const noexcept {
    return PlanarVector(0, s.heave_mps) + s.pitch_radps * perp(turn(s) * from_centre_);
  }
  /// Boom pin from the tracks' middle on the ground, axes M.
  [[nodiscard]] const PlanarVector& from_centre_m() const noexcept { return from_centre_; }
  /// Own inertia against heave and pitch: mass, first moment about the centre (axes M), second moment.
  [[nodiscard]] const HullTruth& truth() const noexcept { return truth_; }
  [[nodiscard]] PlanarVector first_kgm() const noexcept { return truth_.mass_kg * truth_.com_m; }
  [[nodiscard]] double second_kgm2() const noexcept {
    return truth_.inertia_kgm2 + truth_.mass_kg * truth_.com_m.squaredNorm();
  }

  [[nodiscard]] Ground ground(const HullState& s) const noexcept;
  /// Pushes that hold this much at rest, from the start on. @throws InputError where the machine would tip over.
  void stand(double heave_N, double pitch_Nm, const std::string& source);
  /// Sinks what is overloaded for good, after a substep. @return what the ground's springs lose by it [J].
  double settle(const HullState& s, double dt) noexcept;

 private:
  [[nodiscard]] double sinking(std::size_t end, double heave, double pitch) const noexcept {
    return -heave - (end == 0 ? -0.5 : 0.5) * truth_.track_m * pitch;
  }

  HullTruth truth_;
  double start_pitch_rad_;
  PlanarVector from_centre_, pin_start_m_;
  std::array<double, 2> rest_N_{};     // push at no sinking
  std::array<double, 2> settled_m_{};  // for good
  std::array<double, 2> borne_N_{};    // the most that the ground has borne: below it is elastic
};

}  // namespace knuckle::sim
