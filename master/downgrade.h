// When a force would mislead: link or estimate is sick for long enough, and until it has been sound for long enough.
#pragma once

#include "core/reason.h"
#include "master/felt_inputs.h"

namespace knuckle::master {

/// Each cause begins when its value has been beyond `on` for on_s and ends when it has been within `off` for off_s;
/// between them nothing changes. Judged only while the hand leads the machine: else nothing is felt, and the next
/// engagement begins sound.
class Downgrade {
 public:
  struct Bounds {
    double on, off, on_s, off_s;
  };
  // Above the round trips that the echo spring is held to (0.4 s), below the one at which the machine holds (0.5 s).
  static constexpr Bounds kRoundTrip_s{0.45, 0.42, 1, 3};
  // A local spring has faded long before; shorter outages end in link_lost, which speaks for itself.
  static constexpr Bounds kSilence_s{1.5, 0.05, 0, 3};
  static constexpr Bounds kLost{0.7, 0.5, 1, 3};   // about 60 of 200 messages per second are left
  static constexpr Bounds kDoubt{0.9, 0.6, 3, 3};  // 1 - confidence: where the force has faded to nothing, and full

  /// @return the standing cause; kNone: sound.
  [[nodiscard]] Reason step(const FeltInputs& in, double dt_s) noexcept;

 private:
  struct Cause {
    bool on = false;
    double for_s = 0;
    void step(double value, const Bounds& bounds, double dt_s) noexcept;
  };
  Cause round_trip_, silence_, lost_, doubt_;
};

}  // namespace knuckle::master
