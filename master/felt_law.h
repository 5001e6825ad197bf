// The force in the hand: the bilateral laws, and cues in their place while link or estimate is sick.
#pragma once

#include <cstdint>
#include <variant>

#include "core/joints.h"
#include "core/reason.h"
#include "machine/device_description.h"

namespace knuckle::master {

/// A machine that is silent for longer is felt no more, or less and less.
inline constexpr double kHoldSilence_s = 0.3;

/// Positions, speeds and forces at hand scale, frame D.
struct FeltInputs {
  PlanarVector hand_m = PlanarVector::Zero();     ///< x_m: tip of the set-point the hand asks for
  PlanarVector hand_mps = PlanarVector::Zero();   ///< v_m
  PlanarVector machine_m = PlanarVector::Zero();  ///< x_s: newest measured machine tip
  PlanarVector machine_mps = PlanarVector::Zero();
  PlanarVector ahead_m = PlanarVector::Zero();      ///< x_a: how far the set-point was ahead of it behind reflected_N
  PlanarVector reflected_N = PlanarVector::Zero();  ///< R = lambda * estimated force of the world on the tip
  PlanarVector load_N = PlanarVector::Zero();       ///< lambda * what the load adds to it
  double sigma_N = 0;                               ///< lambda * standard deviation of R
  double contact_compliance = 0;                    ///< y [0, 1]: what is pressed moves along with the tip
  double confidence = 0;                            ///< [0, 1]
  double round_trip_s = 0;
  double silence_s = 0;   ///< Since the last newer message from the machine.
  double lost_share = 0;  ///< [0, 1] of its messages, of late: lost or overtaken.
  bool engaged = false;   ///< The hand leads the machine: only then there is a force.
};

/// The felt force of the default law: a local, contact-gated spring at the hand, anchored on the machine's measured
/// position (quick) and trimmed by what the machine tells of position error and force (exact in the end). A load is
/// felt beside it. With n the contact normal (out of the wall, direction of R beyond 0.25 rad from n, low-passed at 0.3
/// Hz), a the anchor, K the spring, v_c the machine's speed times y, low-passed:
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

// No kinesthetic force: contact, overload and a load that is picked up are signalled by short vibrations, too small to
// move a hand and too small to close a loop over the link.

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

/// Raw force reflection, F = R: the cautionary baseline. The loop hand -> machine -> force -> hand has the gain
/// K_l / K_hand at rest (K_l = lambda mu Ks in series with lambda mu K_wall) and the delay of round trip, valve and
/// observer. By the small-gain theorem it is stable for any delay where that gain is below 1 at all frequencies; where
/// the hand is softer than that and its phase turns half a turn before the gain has fallen below 1, it is not.
class DirectLaw {
 public:
  explicit DirectLaw(double force_limit_N) noexcept : force_limit_N_(force_limit_N) {}
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double /*dt_s*/) noexcept {
    constexpr double kSilence_s = 0.5;
    if (!in.engaged || in.silence_s > kSilence_s) return PlanarVector::Zero();
    const double size_N = in.reflected_N.norm();
    return size_N > force_limit_N_ ? PlanarVector(in.reflected_N * (force_limit_N_ / size_N)) : in.reflected_N;
  }

 private:
  double force_limit_N_;
};

/// When a force would mislead: link or estimate is sick for long enough, and until it has been sound for long enough.
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

class FeltLaw {
 public:
  FeltLaw(ControlLaw law, const DeviceDescription::Feel& feel) noexcept;

  /// One millisecond. Between law and cues the force is faded over a second. kDirect is never downgraded: what it does
  /// over a bad link is what it is kept for.
  /// @return force on the hand at the tip [N], frame D, within the device's force limit. Not slew-limited.
  [[nodiscard]] PlanarVector step(const FeltInputs& in, double dt_s) noexcept;

  /// Of that, what the hand is held against by a contact: without cues, which are signals, and without the load's
  /// weight. It bounds what the machine presses (MasterMessage::rendered_N), so that neither moves it or lets it press
  /// harder.
  [[nodiscard]] const PlanarVector& rendered_N() const noexcept { return rendered_N_; }

  /// K_l = lambda mu Ks; to be kept in step with the scales. Only while not engaged.
  void set_spring(double spring_N_per_m) noexcept;

  [[nodiscard]] ControlLaw law() const noexcept { return static_cast<ControlLaw>(law_.index()); }
  /// Why cues have taken the law's place; kNone: they have not.
  [[nodiscard]] const Reason& downgraded() const noexcept { return downgraded_; }
  [[nodiscard]] Cue cue() const noexcept;  ///< Being given.
  /// nullptr with another law.
  [[nodiscard]] const EchoSpring* spring() const noexcept { return std::get_if<EchoSpring>(&law_); }

 private:
  std::variant<EchoSpring, CuesLaw, DirectLaw> law_;  // in the order of ControlLaw
  CuesLaw cues_;
  Downgrade downgrade_;
  Reason downgraded_;
  double cues_share_ = 0;
  PlanarVector rendered_N_ = PlanarVector::Zero();
};

}  // namespace knuckle::master
