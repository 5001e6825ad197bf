// One direction of a pair of wave variables over the link. Sent as its integral and its energy, so that nothing is lost
// with a message; played out after a constant delay, never with more energy than was put in.
#pragma once

#include <array>
#include <cstddef>

#include "core/joints.h"
#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle {

/// The far end of one direction, after Niemeyer and Slotine, "Telemanipulation with time delays" (2004):
///   x(t)  = U(t - transit - kPlayOut),  U the received integral of the wave, interpolated between messages
///   wave  = (x - played) / kSmoothing,  played = integral of wave: a low-pass, of gain 1 at most
/// scaled down wherever the sum of |wave|^2 / 2 dt would exceed the energy that the sender reports to have put in.
/// Its energies are received with max(): loss and reordering can only make it conservative.
class WaveReceiver {
 public:
  static constexpr Duration kPlayOut = 10ms;  ///< Covers that much jitter.
  static constexpr double kSmoothing_s = 0.02;

  /// @param sent_at the sender's clock; what is not newer than all before is only asked for its energy.
  void take(Time sent_at, const Wave& wave, Time now) noexcept;
  /// Nothing is led: what has come so far is not played any more, and its energy is gone.
  void skip() noexcept;
  /// @return the wave [sqrt(W)] of this step.
  [[nodiscard]] PlanarVector step(Time now, double dt_s) noexcept;
  /// Takes energy_J out of what was received and not yet played. @return false, and nothing changes, where it is more
  /// than that.
  [[nodiscard]] bool pay(double energy_J) noexcept;

  [[nodiscard]] double received_J() const noexcept { return received_J_; }
  [[nodiscard]] double spent_J() const noexcept { return spent_J_; }

 private:
  struct Sample {
    Time at{};
    PlanarVector integral = PlanarVector::Zero();
  };
  static constexpr std::size_t kKept = 64;  ///< 0.13 s of the faster sender.

  [[nodiscard]] const Sample& kept(std::size_t age) const noexcept;
  [[nodiscard]] PlanarVector integral_at(Time at) const noexcept;

  std::array<Sample, kKept> samples_{};
  std::size_t newest_ = 0, count_ = 0;
  Duration transit_{};  // least arrival time minus stamp: clocks differ, and it need not be known by how much
  PlanarVector played_ = PlanarVector::Zero();
  double received_J_ = 0, spent_J_ = 0;
  bool fresh_ = true;
};

}  // namespace knuckle
