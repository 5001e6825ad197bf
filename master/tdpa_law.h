// Time-domain passivity at the hand's port, with a force computed from positions.
#pragma once

#include "machine/device_description.h"
#include "master/felt_inputs.h"

namespace knuckle::master {

/// Force in contact, along n = R / |R|, one-sided (no drag in free motion):
///   F = max(0, K n.(x_s - x_m)) n - alpha v_m
/// Observer and controller (Hannaford and Ryu 2002; Ryu, Artigas and Preusche 2010 for energies that travel):
///   W = E_in - E_out + lambda / mu E_world,   alpha = max(0, -W) / (|v_m|^2 dt), at most kMostDamping
/// E_in, E_out: what the hand put in and got back through F; E_world: what the world put into the machine, as last
/// heard (received with max(): loss and reordering only make it smaller, so W is conservative). The machine's own port
/// is not in W: its valves draw on a pump, and the work that it does on the world is not the hand's. So this bounds
/// what the hand gets back, and only that. The controller changes the force alone, never the set-point: positions
/// cannot drift apart.
class TdpaLaw {
 public:
  explicit TdpaLaw(const DeviceDescription::Feel& feel) noexcept : feel_(feel), spring_N_per_m_(feel.spring_N_per_m) {}
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double dt_s) noexcept;
  /// Only while not engaged.
  void set_spring(double spring_N_per_m) noexcept { spring_N_per_m_ = spring_N_per_m; }
  [[nodiscard]] double damping_Ns_per_m() const noexcept { return damping_Ns_per_m_; }
  /// Share of the force that reaches the hand from now on, [0, 1]: only that does work.
  void set_rendered(double share) noexcept { rendered_ = share; }

 private:
  [[nodiscard]] PlanarVector spring_force(const FeltInputs& in, double dt_s) noexcept;

  DeviceDescription::Feel feel_;
  double spring_N_per_m_;
  bool contact_ = false;
  double share_ = 0;  // of the force: fades with contact, silence and confidence
  double world_J_ = 0;
  double observed_J_ = 0, damping_Ns_per_m_ = 0, rendered_ = 1;
  PlanarVector normal_ = PlanarVector::UnitX();
};

}  // namespace knuckle::master
