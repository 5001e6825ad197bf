// One axis of a whole session, small enough to read: a limb that holds the law's hand side, a link with delay, a slave
// with the joint law of the machine side, oil and wall as springs. Positions along one oblique line in the plane.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/filters.h"
#include "master/felt_law.h"
#include "master/master_loop.h"
#include "tests/master/desk.h"

namespace knuckle::test {

struct OneAxisCase {
  double round_trip_s = 0.02;
  double wall_N_per_m = 1e6;
  sim::LimbImpedance limb = steady_limb();
  double approach_mps = 0.01;  ///< Of the hand: a tenth of a metre per second of the machine.
  double press_m = 0.006;      ///< How far beyond the wall the hand means to be.
  double force_error = 1.0;    ///< Estimated over true force.
};

/// A delay line of whole milliseconds.
template <typename T>
class Delay {
 public:
  Delay(double delay_s, T initial) : ring_(std::size_t(std::lround(delay_s * 1e3)) + 1, initial) {}
  T step(const T& in) {
    ring_[at_] = in;
    at_ = (at_ + 1) % ring_.size();
    return ring_[at_];
  }

 private:
  std::vector<T> ring_;
  std::size_t at_ = 0;
};

/// Distance into the wall is positive; forces of the world on the machine and of the device on the hand point out of
/// it.
class OneAxis {
 public:
  static constexpr double kMu = 10, kLambda = 1e-3;

  explicit OneAxis(const OneAxisCase& setting, const DeviceDescription::Feel& feel = {})
      : setting_(setting),
        feel_(feel),
        law_(feel),
        forward_(setting.round_trip_s / 2, {}),
        back_(setting.round_trip_s / 2, {}),
        valve_delay_(0.02, 0.0),
        motor_delay_(0.003, 0.0) {
    hand_m = intent_m = -kStart_m;
    oil_m_ = tip_m_ = -kStart_m * kMu;
    const Up start{hand_m, 0};
    for (int i = 0; i < 1000; ++i) {
      forward_.step(start);
      back_.step({tip_m_, 0, 0, 0});
    }
  }

  void step() {
    hand_step();
    slave_step(forward_.step({hand_m, hand_mps}));
    if (tick_++ % 5 == 0) sent_ = {tip_m_, tip_mps_, ahead_.value(), slow_.value()};
    seen_ = back_.step(sent_);
    const double wanted_N = law_force();
    felt_N += std::clamp(motor_delay_.step(wanted_N) - felt_N, -feel_.slew_N_per_ms, feel_.slew_N_per_ms);
  }
  void run(double seconds) {
    for (int i = 0; i < int(seconds * 1e3 + 0.5); ++i) step();
  }

  double intent_m, intent_mps = 0;
  double hand_m, hand_mps = 0;  // along the axis
  double felt_N = 0;
  double wall_N = 0;     // true contact force at the machine
  double wall_at_m = 0;  // machine metres; move it away for a break
  bool silent = false;   // nothing comes from the machine
  double time_s() const { return tick_ * 1e-3; }
  const master::EchoSpring& law() const { return law_; }

 private:
  static constexpr double kStart_m = 0.02;
  struct Up {
    double position_m, speed_mps;
  };
  struct Down {
    double tip_m, tip_mps, ahead_m, force_N;
  };

  void hand_step() {
    intent_m += 1e-3 * intent_mps;
    const auto& limb = setting_.limb;
    const double mass = limb.mass_kg + 0.1;  // and the device's own
    for (int i = 0; i < 4; ++i) {
      const double force_N =
          -felt_N + limb.stiffness_N_per_m * (intent_m - hand_m) + limb.damping_Ns_per_m * (intent_mps - hand_mps);
      hand_mps += 0.25e-3 * force_N / mass;
      hand_m += 0.25e-3 * hand_mps;
    }
  }

  void slave_step(const Up& reference) {
    constexpr double kKp = 3, kKs = 1e5, kF1 = 500;
    const double faded = std::max(0.0, 1 - std::abs(slow_.value()) / kF1);
    const double wanted_mps =
        kKp * (kMu * reference.position_m - tip_m_) + kMu * reference.speed_mps * faded - kKp / kKs * fast_.value();
    valve_mps_ += (valve_delay_.step(std::clamp(wanted_mps, -1.0, 1.0)) - valve_mps_) * (1 - std::exp(-1e-3 / 0.02));
    constexpr double kMass = 250, kOil = 1.2e5, kOilDamping = 4e3;  // at the tip
    const double damping = 2 * 0.3 * std::sqrt(kMass * setting_.wall_N_per_m);
    for (int i = 0; i < 10; ++i) {
      const double depth_m = tip_m_ - wall_at_m;
      wall_N = depth_m > 0 ? std::max(0.0, setting_.wall_N_per_m * depth_m + damping * tip_mps_) : 0;
      oil_m_ += 1e-4 * valve_mps_;
      tip_mps_ += 1e-4 / kMass * (kOil * (oil_m_ - tip_m_) + kOilDamping * (valve_mps_ - tip_mps_) - wall_N);
      tip_m_ += 1e-4 * tip_mps_;
    }
    slow_.step(setting_.force_error * wall_N);
    ahead_.step(kMu * reference.position_m - tip_m_);
    fast_.step(setting_.force_error * wall_N);
  }

  double law_force() {
    silence_s_ = silent ? silence_s_ + 1e-3 : 0;
    if (!silent) acted_on_ = seen_;
    master::FeltInputs in;
    in.hand_m = hand_m * kInto + kAside;
    in.hand_mps = hand_mps * kInto;
    in.machine_m = acted_on_.tip_m / kMu * kInto + kAside;
    in.machine_mps = acted_on_.tip_mps / kMu * kInto;
    in.ahead_m = acted_on_.ahead_m / kMu * kInto;
    in.reflected_N = -kLambda * acted_on_.force_N * kInto;
    in.sigma_N = 0.03;
    in.confidence = 1;
    in.round_trip_s = setting_.round_trip_s;
    in.silence_s = silence_s_;
    in.engaged = true;
    return -law_.step(in, 1e-3).dot(kInto);
  }

  inline static const PlanarVector kInto = PlanarVector(0.8, -0.6);
  inline static const PlanarVector kAside = PlanarVector(0.1, 0.2);
  OneAxisCase setting_;
  DeviceDescription::Feel feel_;
  master::EchoSpring law_;
  Delay<Up> forward_;
  Delay<Down> back_;
  Delay<double> valve_delay_, motor_delay_;
  LowPass<double> slow_{3, 1e-3, 0.0}, ahead_{3, 1e-3, 0.0}, fast_{6, 1e-3, 0.0};
  Down sent_{}, seen_{}, acted_on_{};
  double oil_m_, tip_m_, tip_mps_ = 0, valve_mps_ = 0, silence_s_ = 0;
  int tick_ = 0;
};

/// Approach, press, hold ten seconds, release.
struct HoldResult {
  double swing_N = 0;   ///< Peak to peak of the felt force over the last three seconds of the hold.
  double error_N = 0;   ///< |lambda F - felt| in their mean.
  double true_N = 0;    ///< lambda F in their mean.
  double rise_s = 1e9;  ///< Felt force reaches 90 % of its hold this long after the true force did.
  double energy_J = 0;  ///< Net work of the device on the hand over the whole story.
  double slew_N_per_ms = 0;
  double released_s = 1e9;  ///< From leaving the wall until less than 0.1 N is felt.
  bool stable() const { return swing_N < 1; }
};

inline HoldResult hold(const OneAxisCase& setting) {
  OneAxis axis(setting);
  HoldResult result;
  std::vector<double> felt, truth;
  double last_N = 0, low = 1e9, high = -1e9, sum_felt = 0, sum_true = 0;
  const auto step = [&] {
    axis.step();
    result.energy_J -= axis.felt_N * axis.hand_mps * 1e-3;
    result.slew_N_per_ms = std::max(result.slew_N_per_ms, std::abs(axis.felt_N - last_N));
    last_N = axis.felt_N;
  };
  axis.run(0.5);
  axis.intent_mps = setting.approach_mps;
  const double travel_s = (0.02 + setting.press_m) / setting.approach_mps;
  for (int i = 0; i < int((travel_s + 10) * 1e3); ++i) {
    if (i == int(travel_s * 1e3)) axis.intent_mps = 0;
    step();
    felt.push_back(axis.felt_N);
    truth.push_back(OneAxis::kLambda * axis.wall_N);
    if (i < int((travel_s + 7) * 1e3)) continue;
    low = std::min(low, axis.felt_N);
    high = std::max(high, axis.felt_N);
    sum_felt += axis.felt_N;
    sum_true += OneAxis::kLambda * axis.wall_N;
  }
  result.swing_N = high - low;
  result.true_N = sum_true / 3000;
  result.error_N = std::abs(sum_true - sum_felt) / 3000;
  const auto reached = [&](const std::vector<double>& force_N) {
    return 1e-3 * double(std::ranges::find_if(force_N, [&](double f) { return f >= 0.9 * sum_felt / 3000; }) -
                         force_N.begin());
  };
  result.rise_s = reached(felt) - reached(truth);
  axis.intent_mps = -3 * setting.approach_mps;
  double left_s = -1;
  const int retreat_ms = int((setting.press_m + 0.02) / (3 * setting.approach_mps) * 1e3);
  for (int i = 0; i < retreat_ms + 3000; ++i) {
    if (i == retreat_ms) axis.intent_mps = 0;
    step();
    if (axis.wall_N > 0) left_s = -1;
    if (left_s < 0 && axis.wall_N == 0) {
      left_s = axis.time_s();
      result.released_s = 1e9;
    }
    if (axis.felt_N < 0.1 && result.released_s > 1e8 && left_s >= 0) result.released_s = axis.time_s() - left_s;
    if (axis.felt_N >= 0.1) result.released_s = 1e9;
  }
  return result;
}

}  // namespace knuckle::test
