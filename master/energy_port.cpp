// Energy accounting at the hand.
#include "master/energy_port.h"

#include <algorithm>
#include <cmath>

namespace knuckle::master {
namespace {

constexpr double kFall_s = 0.5, kRise_s = 5;

}  // namespace

void EnergyPort::step(double power_to_hand_W, double dt_s) noexcept {
  const double energy_J = power_to_hand_W * dt_s;
  (energy_J > 0 ? out_J_ : in_J_) += std::abs(energy_J);
  slots_J_[slot_] += energy_J;
  window_J_ += energy_J;
  slot_filled_s_ += dt_s;
  if (slot_filled_s_ > kSlot_s - 0.5 * dt_s) {
    slot_filled_s_ = 0;
    slot_ = (slot_ + 1) % kSlots;
    slots_J_[slot_] = 0;
    window_J_ = 0;  // summed again: a running sum would drift
    for (const double slot_J : slots_J_) window_J_ += slot_J;
  }
  const double change = window_J_ > kReturnedLimit_J ? -dt_s / kFall_s : dt_s / kRise_s;
  gain_ = std::clamp(gain_ + change, 0.0, 1.0);
}

}  // namespace knuckle::master
