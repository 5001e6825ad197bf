// The operator's hand and eyes as far as they do not follow the plan: tremor, drift, giving way in a hold, slips, and
// late, slow correction by what the screen shows. Sizes and sources: sim/README.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <random>

#include "core/joints.h"
#include "core/time.h"

namespace knuckle::sim {

// Mechanical impedance of the limb that holds the haptic device. What the operator *wants* is not here.

/// How the operator holds the device.
enum class LimbClass : std::uint8_t { kRelaxed, kNormal, kCoContracted, kLightGrip };
[[nodiscard]] const char* name(LimbClass limb) noexcept;

/// Mass, damping and stiffness of the hand at the fingertip (the device's tip, the same in every direction of the
/// plane), and of the wrist about the finger's absolute angle. They act on the device's joints through the device's
/// own Jacobian J and the row of ones e = (1 1 1): M = m J^T J + I e^T e, likewise damping; the springs pull between
/// the tip and finger angle and where the operator means them to be, so they are conservative in every posture.
struct LimbImpedance {
  double mass_kg = 0;
  double damping_Ns_per_m = 0;
  double stiffness_N_per_m = 0;
  double wrist_inertia_kgm2 = 0;
  double wrist_damping_Nms = 0;
  double wrist_stiffness_Nm = 0;                                ///< Per radian.
  double strength_N = std::numeric_limits<double>::infinity();  ///< Most that the springs and dampers of the hand pull.
};

/// One limb sampled log-uniformly from its class's ranges; the same for the same seed.
[[nodiscard]] LimbImpedance sample_limb(LimbClass limb, std::uint64_t seed) noexcept;

/// How much of a person the operator is.
enum class PersonClass : std::uint8_t {
  kExact,   ///< The plan itself: the hand means to be exactly where it says.
  kSteady,  ///< A practised operator, rested.
  kRough,   ///< A tired or untrained one.
};
[[nodiscard]] const char* name(PersonClass person) noexcept;

/// The default is exact: it does nothing of its own.
struct Person {
  bool corrects = false;  ///< Moves the hand until the screen shows what was meant, at the rate correction_1ps().
  double tremor_m = 0;    ///< RMS of the fingertip of a hand that holds nothing, in each direction.
  double tremor_Hz = 9;
  double drift_radps = 0;                              ///< Fastest unwatched drift of each joint of the hand.
  double give_way = 0;                                 ///< Share of a held push that is lost in the long run,
  double give_way_s = 15;                              ///< with this time constant.
  double slips_per_s = 0;                              ///< Mean rate at which the grip loosens,
  double shortest_slip_s = 0.1, longest_slip_s = 0.3;  ///< for so long,
  double slipping_grip = 0.15;                         ///< to this share of the limb.
};

/// One person of a class; the same for the same seed.
[[nodiscard]] Person sample_person(PersonClass person, std::uint64_t seed) noexcept;

/// What a hand of this class holds for minutes, and the most that it pulls.
[[nodiscard]] double sustained_N(LimbClass limb) noexcept;
[[nodiscard]] double strength_N(LimbClass limb) noexcept;

/// Crossover of a person who follows by eye, rad/s: 2 pi 0.16 / (T + 0.15)^0.85 with T the delay beyond the 0.15 s of
/// the person (human frequency response against visual feedback delay; sim/README.md).
[[nodiscard]] double correction_1ps(Duration reaction) noexcept;
/// Fastest correction that this limb with a device in it follows without being made to swing, 1/s: an integrator of
/// gain g in front of a mass on a damped spring is stable below g = b/m; half of it.
[[nodiscard]] double steady_below_1ps(const LimbImpedance& limb) noexcept;

/// Tremor, drift and slips of a person's hand, one step a millisecond.
class Unsteadiness {
 public:
  Unsteadiness() = default;  ///< Of an exact hand: none.
  Unsteadiness(const Person& person, const LimbImpedance& limb, std::uint64_t seed);

  void step(Time now) noexcept;
  [[nodiscard]] const Person& person() const noexcept { return person_; }
  [[nodiscard]] const PlanarVector& push_N() const noexcept { return push_N_; }       ///< Of trembling muscles.
  [[nodiscard]] const JointVector& drift_rad() const noexcept { return drift_rad_; }  ///< Of the hand.
  [[nodiscard]] double steady_below_1ps() const noexcept { return steady_below_1ps_; }
  [[nodiscard]] double grip() const noexcept { return grip_; }  ///< Share of the limb that holds.

 private:
  struct Wave {
    double amplitude = 0, radps = 0, phase_rad = 0;
    [[nodiscard]] double at(double t_s) const noexcept;
  };
  static constexpr std::size_t kTremorWaves = 5, kDriftWaves = 3;

  Person person_;
  std::mt19937_64 random_;
  std::array<std::array<Wave, kTremorWaves>, 2> tremor_{};      ///< [N], by direction.
  std::array<std::array<Wave, kDriftWaves>, kJoints> drift_{};  ///< [rad]
  PlanarVector push_N_ = PlanarVector::Zero();
  JointVector drift_rad_ = JointVector::Zero();
  double steady_below_1ps_ = std::numeric_limits<double>::infinity();
  double grip_ = 1;
  Time slip_from_ = Time::max(), slip_until_ = Time::max();
};

}  // namespace knuckle::sim
