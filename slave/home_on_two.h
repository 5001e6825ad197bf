// Home on two: going on without the pressures of one cylinder whose transmitters failed, because the operator chose to,
// and in no other way. The fault is acknowledged first; from then on the cylinder's pressures count as not measured,
// so that what the two others tell is known, but nothing moves. Then a HomeMessage chooses; it is refused where
// something may be pressed. What was chosen holds until the program starts anew.
#pragma once

#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"

namespace knuckle::slave {

/// Whether all that this node sends is pressures of that joint's cylinder.
[[nodiscard]] bool only_pressures_of(int joint, const NodeDescription& node) noexcept;

class HomeOnTwo {
 public:
  static constexpr Duration kLeastOffered = 1s;  ///< Before a choice: the two other cylinders must have been looked at.
  static constexpr Duration kRefusalShown = 2s;

  explicit HomeOnTwo(const MachineDescription& machine);

  /// The cylinder whose pressures, and nothing else, this fault takes away. nullopt where it takes more, where the
  /// machine lacks a cylinder's pressures already (then another one's failure is a stop), or where its chamber limit is
  /// below the pump's relief: only pressures can hold that.
  [[nodiscard]] std::optional<int> cylinder_of(const Reason& fault) const noexcept;

  /// A sensor contradicts the others while the machine is led. Where a transmitter does so for the second time, that is
  /// a reason to stay until it was acknowledged: a machine that stands does not show it, and would stop again and
  /// again.
  void note_contradiction(const Reason& fault) noexcept;
  void offer(int joint, Time now) noexcept;
  void withdraw() noexcept;
  /// While all pressures are known: whether something is pressed, as far as the force tells.
  void note_pressed(bool pressed, double force_N) noexcept;

  /// What the machine's side knows of itself when it is asked.
  struct Machine {
    bool enable = false;  ///< The operator holds it.
    JointVector rate_radps = JointVector::Zero();
    bool pressed = false;  ///< As far as two torques tell.
    double force_N = 0;
  };
  /// The operator chooses: taken or refused with a reason that blocking() shows.
  void choose(const Machine& machine, Time now) noexcept;

  [[nodiscard]] bool offered() const noexcept { return stage_ == Stage::kOffered; }
  [[nodiscard]] bool chosen() const noexcept { return stage_ == Stage::kChosen; }
  /// Of the offer or the choice.
  [[nodiscard]] int joint() const noexcept { return joint_; }
  /// What keeps the machine from going on: the offer, a refusal, or a contradiction that stays; else kNone.
  [[nodiscard]] Reason blocking(Time now) const noexcept;

 private:
  enum class Stage : std::uint8_t { kNothing, kOffered, kChosen };
  [[nodiscard]] Reason refusal(const Machine& machine) const noexcept;

  BusDescription bus_;
  bool possible_;
  Stage stage_ = Stage::kNothing;
  int joint_ = 0;
  Time offered_at_ = kNever, refused_at_ = kNever;
  Reason refused_, contradicted_, stays_;
  bool pressed_before_ = false;  // in the last step with all pressures
  double force_before_N_ = 0;
};

}  // namespace knuckle::slave
