// Wave variables at the hand: strictly passive over any delay, loss or jitter, at the price of a force that is soft
// (b / delay), late and burdened with the reflections of the line.
#pragma once

#include "machine/device_description.h"
#include "master/felt_inputs.h"
#include "transport/wave_line.h"

namespace knuckle::master {

/// In machine units (V = mu v, F = f / lambda, so that power is P = mu / lambda times that of the hand), with f against
/// the hand's motion, b the wave impedance, u the wave that leaves and w the wave that returns (Anderson and Spong
/// 1989; Niemeyer and Slotine 1991):
///   f = b V - sqrt(2 b) w,   u = (b V + f) / sqrt(2 b),   f V = (u^2 - w^2) / 2
/// The force limit breaks the last equation; u is then made smaller, so that no wave leaves with energy that neither
/// hand nor returning wave has put in.
class WaveLaw {
 public:
  static constexpr double kHand_Ns_per_m = 20;  ///< b as the hand feels it: lambda mu times that of the machine

  explicit WaveLaw(double force_limit_N) noexcept : force_limit_N_(force_limit_N) {}
  /// @return force on the hand at the tip [N], frame D.
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double dt_s) noexcept;

  /// How much of the next steps' force the hand gets: what it does not feel it does no work against, so that no wave
  /// may leave with it. @param share in [0, 1]
  void set_rendered(double share) noexcept { rendered_ = share; }

  [[nodiscard]] double impedance_Ns_per_m() const noexcept { return impedance_Ns_per_m_; }
  [[nodiscard]] const Wave& leaving() const noexcept { return leaving_; }

 private:
  double force_limit_N_;
  double impedance_Ns_per_m_ = 0;
  WaveReceiver returning_;
  Wave leaving_;
  double kept_J_ = 0;  ///< Energy in the port that has not left: never negative.
  double rendered_ = 1;
};

}  // namespace knuckle::master
