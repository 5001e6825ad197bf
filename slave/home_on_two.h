// Home on two: going on without the pressures of one cylinder whose transmitters failed, because the operator chose to,
// and in no other way. The fault is acknowledged first; from then on the cylinder's pressures count as not measured,
// so that what the two others tell is known, but nothing moves. Then a HomeMessage chooses; it is refused where
// something may be pressed. What was chosen holds until the program starts anew.
#pragma once

#include <array>
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
  static constexpr Duration kLookedAt = 1s;      ///< So long it must have stood and touched nothing before a choice.
  static constexpr Duration kRefusalShown = 2s;  ///< After the last message that was refused.

  explicit HomeOnTwo(const MachineDescription& machine);

  /// The cylinder whose pressures, and nothing else, this fault takes away. nullopt where it takes more, where the
  /// machine lacks a cylinder's pressures already (then another one's failure is a stop), or where its chamber limit is
  /// below the pump's relief: only pressures can hold that.
  [[nodiscard]] std::optional<int> cylinder_of(const Reason& fault) const noexcept;

  /// Whether it has failed beside the cylinder that was acknowledged: nothing is offered then, but that its pressures
  /// count as not measured can be taken back.
  [[nodiscard]] bool hindered_by(const Reason& fault) const noexcept;

  /// While all pressures are known and believed: whether something is pressed. Before the first time something may be.
  void note_pressed(bool pressed, Time now) noexcept;
  /// A sensor contradicts the others while the machine is led. A transmitter of a cylinder that can be gone without has
  /// lied for a while then: what was pressed before counts.
  void note_contradiction(const Reason& fault, Time now) noexcept;
  void offer(int joint) noexcept;
  void withdraw() noexcept;

  /// What the machine's side knows of itself.
  struct Machine {
    bool known = false;   ///< Its nodes work, and its sensors but for those of the cylinder.
    bool enable = false;  ///< The operator holds it.
    JointVector rate_radps = JointVector::Zero();
    bool pressed = false;  ///< As far as two torques tell.
  };
  /// Each step.
  void look(const Machine& machine, Time now) noexcept;
  /// The operator chooses for this cylinder (HomeMessage::cylinder): taken, or refused with a reason that blocking()
  /// shows; nothing where another one or none is offered. After look().
  void choose(unsigned cylinder, Time now) noexcept;

  /// Not while anything else has failed, or is still being started.
  [[nodiscard]] bool offered() const noexcept { return stage_ == Stage::kOffered && machine_.known; }
  [[nodiscard]] bool chosen() const noexcept { return stage_ == Stage::kChosen; }
  /// Of the offer or the choice.
  [[nodiscard]] int joint() const noexcept { return joint_; }
  /// What keeps the machine from going on: the offer or a refusal; else kNone.
  [[nodiscard]] Reason blocking(Time now) const noexcept;

 private:
  enum class Stage : std::uint8_t { kNothing, kOffered, kChosen };
  [[nodiscard]] Reason refusal() const noexcept;

  BusDescription bus_;
  bool possible_;
  Stage stage_ = Stage::kNothing;
  int joint_ = 0;
  Machine machine_;
  Time calm_since_ = kNever;
  Time refused_at_ = kNever, contradicted_at_ = kNever;
  Reason refused_;
  bool pressed_ = true;                                   ///< In the newest step that counts, ...
  std::array<bool, 3> pressed_before_{true, true, true};  ///< ... at any time of this second and of two before it.
  Time noted_at_ = kNever;
};

}  // namespace knuckle::slave
