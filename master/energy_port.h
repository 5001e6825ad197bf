// Energy through the hand's port, and the watchdog that lowers the force when it gives back more than was put in.
#pragma once

#include <array>
#include <cstddef>

namespace knuckle::master {

class EnergyPort {
 public:
  static constexpr double kReturnedLimit_J = 0.5;

  /// @param power_to_hand_W commanded torque times joint rate: positive where the device drives the hand.
  void step(double power_to_hand_W, double dt_s) noexcept;

  [[nodiscard]] double in_J() const noexcept { return in_J_; }    ///< Put in by the hand; only grows.
  [[nodiscard]] double out_J() const noexcept { return out_J_; }  ///< Given back to the hand; only grows.
  /// Share of the force to render, [0, 1]: falls within half a second while more than 0.5 J net came back in the last
  /// two seconds, rises again over five.
  [[nodiscard]] double gain() const noexcept { return gain_; }
  [[nodiscard]] double returned_in_window_J() const noexcept { return window_J_; }

 private:
  static constexpr std::size_t kSlots = 200;
  static constexpr double kSlot_s = 0.01;  // 2 s in all
  double in_J_ = 0, out_J_ = 0, gain_ = 1;
  std::array<double, kSlots> slots_J_{};
  std::size_t slot_ = 0;
  double slot_filled_s_ = 0, window_J_ = 0;
};

}  // namespace knuckle::master
