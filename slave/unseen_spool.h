// What stands in for spools whose places nobody tells: where they are by what they were told, and whether the joints
// move as the machine's own controller was told.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "core/joints.h"
#include "core/reason.h"
#include "estimation/joint_state.h"
#include "machine/description.h"

namespace knuckle::slave {

/// Where spools should be: their commands behind the delay and the lag that the machine file gives the valves.
class AssumedSpool {
 public:
  AssumedSpool(const MachineDescription& machine, double step_s) noexcept {
    for (std::size_t i = 0; i < kJoints; ++i) {
      const ValveDescription& valve = machine.cylinders[i].valve;
      delay_[i] = std::min(kSlots - 1, static_cast<std::size_t>(std::lround(valve.delay_s / step_s)));
      // A second-order lag has the delay 2 zeta / omega.
      const double lag_s = valve.damping_ratio / (std::numbers::pi * valve.natural_frequency_Hz);
      share_[static_cast<int>(i)] = 1 - std::exp(-step_s / lag_s);
    }
  }
  void reset() noexcept {
    demands_.fill(JointVector::Zero());
    spool_.setZero();
  }
  /// @param demand as on the wire, [-1, 1]
  const JointVector& step(const JointVector& demand) noexcept {
    demands_[next_] = demand;
    for (int i = 0; i < kJoints; ++i) {
      const std::size_t then = (next_ + kSlots - delay_[static_cast<std::size_t>(i)]) % kSlots;
      spool_[i] += share_[i] * (demands_[then][i] - spool_[i]);
    }
    next_ = (next_ + 1) % kSlots;
    return spool_;
  }
  [[nodiscard]] const JointVector& value() const noexcept { return spool_; }

 private:
  static constexpr std::size_t kSlots = 32;  // 125 ms at 250 Hz
  PerJoint<std::size_t> delay_{};
  JointVector share_ = JointVector::Zero(), spool_ = JointVector::Zero();
  std::array<JointVector, kSlots> demands_ = [] {
    std::array<JointVector, kSlots> zeros;
    zeros.fill(JointVector::Zero());
    return zeros;
  }();
  std::size_t next_ = 0;
};

/// A joint must not go further than it was told, nor, where it is told a speed, stand while nothing holds it. Of pilot
/// pressures and currents it is known which way they may move a joint, not how fast: Plausibility looks at the rest.
class MotionMonitor {
 public:
  static constexpr double kWindow_s = 0.5;
  static constexpr double kLag_s = 0.4;        ///< Of the machine's controller, valve and oil.
  static constexpr double kMore = 1.3;         ///< Of what was told: its controller's error.
  static constexpr double kUnasked_rad = 0.1;  ///< Beyond that: oil gives way, a load swings.
  static constexpr double kAnySpeed = 3;       ///< Of a joint's greatest rate: what an open valve may make of it.
  static constexpr double kAsked_radps = 0.05, kLeast = 0.1;  ///< Told for long, at least this share must be seen ...
  static constexpr double kPatience_s = 0.5;
  static constexpr double kHeld = 0.8;  ///< ... unless the driven chamber is at this share of the main relief.

  MotionMonitor(const MachineDescription& machine, double step_s) noexcept
      : step_s_(step_s),
        window_(std::clamp<std::size_t>(static_cast<std::size_t>(kWindow_s / step_s), 1, kSlots - 1)),
        told_for_(std::clamp<std::size_t>(static_cast<std::size_t>((kWindow_s + kLag_s) / step_s), 1, kSlots - 1)),
        held_Pa_(kHeld * machine.hydraulics.main_relief_Pa),
        by_rate_(machine.bus.command_kind == CommandKind::kJointRate) {
    for (int i = 0; i < kJoints; ++i) {
      const auto joint = static_cast<std::size_t>(i);
      for (const bool extend : {false, true}) {
        full_radps_[extend ? 1 : 0][i] =
            by_rate_ ? machine.bus.full_rate_radps(i, extend) : kAnySpeed * machine.links[joint].max_rate_radps;
        shut_[extend ? 1 : 0][i] = by_rate_ ? 0 : machine.cylinders[joint].valve.dead_band(extend);
      }
    }
  }
  void reset() noexcept {
    seen_ = 0;
    idle_s_ = {};
  }
  /// @param demand as on the wire, [-1, 1]. @return kMotionNotFollowing: degrees seen and told
  [[nodiscard]] Reason step(const JointVector& demand, const estimation::JointState& state) noexcept {
    for (int i = 0; i < kJoints; ++i) {
      const double rate = told_radps(i, demand[i]);
      samples_[static_cast<std::size_t>(i)][next_] = {
          state.angle_rad[i], std::copysign(rate, demand[i] * state.lever_m[i]), holds(state, i, demand[i])};
    }
    next_ = (next_ + 1) % kSlots;
    seen_ = std::min(seen_ + 1, kSlots);
    if (seen_ <= told_for_) return {};
    Reason first;
    for (int i = 0; i < kJoints; ++i) {
      const Reason why = look(static_cast<std::size_t>(i));
      if (!first) first = why;
    }
    return first;
  }

 private:
  static constexpr std::size_t kSlots = 256;  // 0.9 s at up to 280 Hz
  struct Sample {
    double angle_rad = 0, told_radps = 0;
    bool held = false;
  };
  /// At most, of a command whose effect is not known.
  [[nodiscard]] double told_radps(int joint, double demand) const noexcept {
    const std::size_t way = demand > 0 ? 1 : 0;
    if (by_rate_) return std::abs(demand) * full_radps_[way][joint];
    return std::abs(demand) > shut_[way][joint] ? full_radps_[way][joint] : 0;
  }
  [[nodiscard]] bool holds(const estimation::JointState& state, int joint, double demand) const noexcept {
    const auto i = static_cast<std::size_t>(joint);
    return !state.pressures_known[i] || state.pressure_Pa[2 * i + (demand > 0 ? 0 : 1)] > held_Pa_;
  }
  [[nodiscard]] Reason look(std::size_t joint) noexcept {
    const auto& samples = samples_[joint];
    const auto before = [&](std::size_t steps) -> const Sample& {
      return samples[(next_ + kSlots - 1 - steps) % kSlots];
    };
    double up_rad = 0, down_rad = 0, least = before(0).told_radps, most = least;
    bool held = false;
    for (std::size_t k = 0; k < told_for_; ++k) {
      const Sample& at = before(k);
      (at.told_radps > 0 ? up_rad : down_rad) += at.told_radps * step_s_;
      least = std::min(least, at.told_radps);
      most = std::max(most, at.told_radps);
      held = held || at.held;
    }
    const double moved_rad = before(0).angle_rad - before(window_).angle_rad;
    const double slowest = least > 0 ? least : most < 0 ? most : 0;  // told all the while
    const bool idle =
        std::abs(slowest) > kAsked_radps && !held && moved_rad * slowest < kLeast * slowest * slowest * kWindow_s;
    double& idle_s = idle_s_[joint];
    idle_s = idle ? idle_s + step_s_ : 0;
    if (idle_s > kPatience_s) return not_following(joint, moved_rad, slowest * kWindow_s);
    if (moved_rad > kMore * up_rad + kUnasked_rad) return not_following(joint, moved_rad, up_rad);
    if (moved_rad < kMore * down_rad - kUnasked_rad) return not_following(joint, moved_rad, down_rad);
    return {};
  }
  [[nodiscard]] static Reason not_following(std::size_t joint, double moved_rad, double told_rad) noexcept {
    constexpr double kDeg = 180 / std::numbers::pi;
    return {ReasonCode::kMotionNotFollowing, static_cast<std::uint8_t>(joint), static_cast<float>(kDeg * moved_rad),
            static_cast<float>(kDeg * told_rad)};
  }

  double step_s_;
  std::size_t window_, told_for_;
  double held_Pa_;
  bool by_rate_;
  // Retracting, extending: speed at the full command, and the command up to which the valve is shut.
  std::array<JointVector, 2> full_radps_{JointVector::Zero(), JointVector::Zero()},
      shut_{JointVector::Zero(), JointVector::Zero()};
  PerJoint<std::array<Sample, kSlots>> samples_{};
  PerJoint<double> idle_s_{};
  std::size_t next_ = 0, seen_ = 0;
};

}  // namespace knuckle::slave
