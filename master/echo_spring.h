// The felt force of the default law: a local, contact-gated spring at the hand, anchored on the machine's measured
// position (quick) and trimmed by what the machine tells of position error and force (exact in the end). A load is felt
// beside it.
#pragma once

#include "core/joints.h"
#include "machine/device_description.h"
#include "master/felt_inputs.h"

namespace knuckle::master {

/// With n the contact normal (out of the wall, direction of R beyond 0.25 rad from n, low-passed at 0.3 Hz), a the
/// anchor, K the spring, v_c the machine's speed times y, low-passed:
///   at contact  a = x_m (no step in force), b = 0
///   a += v_c dt + (x_s + b / K - a) (1 - exp(-dt / t_w))
///   b += e (1 - exp(-dt / tau_b)), clamped; e = R + K x_a - b, |e| <= 1 N; tau_b = bias_time + bias_time_per_rtt * RTT
///        where machine and touched thing move on together, from 0.2 s + RTT on: |e| <= 10 N, bias_time = 0.1 s
///   F_n = max(0, K n.(a - x_m) - b_c n.(v_m - v_c)); across n the spring up to |R_t|, which fades with 1.5 s
///   (friction) and -b_c (v_m - v_c)_t
///        up to 0.3 F_n; and the load beside it
/// The anchor is a vector, so a turning normal moves no force into it. F settles to R: where hand and machine rest
/// K (a - x_m) = K (x_s - x_m) + b = R, and where they move on against a force that stays (y = 1) as well,
/// however far the machine trails. R and x_a come from one message and are equally late, so delay does not part them.
class EchoSpring {
 public:
  explicit EchoSpring(const DeviceDescription::Feel& feel) noexcept
      : feel_(feel), spring_N_per_m_(feel.spring_N_per_m) {}

  /// @return force on the hand at the tip [N], frame D; |F| <= force limit. Not slew-limited.
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double dt_s) noexcept;

  /// K_l = lambda mu Ks; to be kept in step with the scales. Only while not engaged.
  void set_spring(double spring_N_per_m) noexcept { spring_N_per_m_ = spring_N_per_m; }
  /// Of that, what answers a contact: all but the load.
  [[nodiscard]] const PlanarVector& contact_N() const noexcept { return rendered_N_; }
  [[nodiscard]] bool contact() const noexcept { return contact_; }
  [[nodiscard]] const PlanarVector& normal() const noexcept { return normal_; }
  [[nodiscard]] double bias_N() const noexcept { return normal_.dot(bias_N_); }

 private:
  void update_gate(const FeltInputs& in, double dt_s) noexcept;
  void open(const FeltInputs& in) noexcept;
  void close(double fade_time_s) noexcept;
  [[nodiscard]] bool hand_leaves(const FeltInputs& in, double dt_s) noexcept;
  [[nodiscard]] bool wall_gave_way(const FeltInputs& in, double reflected_N) noexcept;
  void update_anchor(const FeltInputs& in, double dt_s) noexcept;
  void update_fades(const FeltInputs& in, double dt_s) noexcept;
  [[nodiscard]] PlanarVector raw_force(const FeltInputs& in) const noexcept;
  [[nodiscard]] PlanarVector catching(const FeltInputs& in, double felt_N) const noexcept;

  DeviceDescription::Feel feel_;
  double spring_N_per_m_;

  bool contact_ = false;
  PlanarVector direction_ = PlanarVector::UnitX();  // low-passed, not of unit length
  PlanarVector normal_ = PlanarVector::UnitX();
  PlanarVector anchor_m_ = PlanarVector::Zero();
  PlanarVector bias_N_ = PlanarVector::Zero();
  double shear_N_ = 0;  // most that is felt across the normal
  double threshold_N_ = 0;
  double recent_speed_mps_ = 0;                       // machine's tip at hand scale, held and released slowly
  double quiet_s_ = 0;                                // since R_n was above R_off
  double touched_s_ = 0;                              // time in contact with a force to learn from
  double leaving_s_ = 0;                              // how long the hand has been moving away
  double cautious_s_ = 0;                             // left of the doubled threshold
  PlanarVector pressed_at_m_ = PlanarVector::Zero();  // machine's tip where R was last felt

  double caught_N_ = 0, catching_s_ = 0;  // most the hand is caught with after a contact was lost; time left of it

  double gate_ = 0, gate_fade_s_ = 0.4;              // share of the force let through; time to close
  double damping_share_ = 0;                         // faded in after opening: no step at contact
  double trust_ = 0;                                 // fade with confidence
  double freshness_ = 1;                             // fade with silence
  double engagement_ = 0;                            // fade of the load with leading the machine
  PlanarVector carried_mps_ = PlanarVector::Zero();  // v_c
  PlanarVector contact_N_ = PlanarVector::Zero(), load_N_ = PlanarVector::Zero();
  PlanarVector rendered_N_ = PlanarVector::Zero();
};

}  // namespace knuckle::master
