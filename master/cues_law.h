// No kinesthetic force: contact, overload and a load that is picked up are signalled by short vibrations, too small to
// move a hand and too small to close a loop over the link.
#pragma once

#include <cstdint>

#include "machine/device_description.h"
#include "master/felt_inputs.h"

namespace knuckle::master {

enum class Cue : std::uint8_t { kNone, kContact, kOverload, kLoad };

/// F = A s(t) sin(2 pi f t) d, s a half sine over the cue's length, d the direction of R: of zero mean, |F| <= A, and
/// |dF/dt| <= 2 pi f A (1 + 1 / (2 f length)) = 0.25 N/ms for the quickest, whatever R, its noise or the link do.
///   contact: once when |R| passes max(on_N, 4 sigma); again only after it was below off_N for 0.3 s
///   load:    likewise with the load's weight
///   overload: repeated while |R| is above half of what the device can render (until below 0.4 of it)
class CuesLaw {
 public:
  explicit CuesLaw(const DeviceDescription::Feel& feel) noexcept : feel_(feel) {}
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double dt_s) noexcept;
  [[nodiscard]] Cue cue() const noexcept { return cue_; }  ///< Being given; for the display.

 private:
  /// An event that is over only once it has been off for a while.
  struct Watch {
    bool on = false;
    double off_s = 0;
    /// @return whether it begins.
    bool step(double value, double above, double below, double dt_s) noexcept;
  };
  [[nodiscard]] Cue next(const FeltInputs& in, double dt_s) noexcept;

  DeviceDescription::Feel feel_;
  Watch contact_, load_, overload_;
  Cue cue_ = Cue::kNone;
  double into_s_ = 0;
  PlanarVector direction_ = PlanarVector::UnitY();
};

}  // namespace knuckle::master
