// What the operator asks for, as far as the machine's side knows: the newest message, whether a hand can have made its
// set-point, how old it is, and the set-point to act on.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "slave/loss_policy.h"
#include "slave/set_point_check.h"
#include "transport/link.h"
#include "transport/link_inbox.h"
#include "transport/link_messages.h"
#include "transport/link_session.h"

namespace knuckle::slave {

class OperatorInput {
 public:
  /// The link must outlive this. @param start drawn anew for each loop.
  OperatorInput(const MachineDescription& machine, Link& link, const LinkStart& start);

  /// Takes what has come over the link, and settles the set-point to act on.
  /// @param machine_rad measured joint angles; nullopt: not known. @param engaged the machine follows the set-point.
  void step(Time now, const std::optional<JointVector>& machine_rad, bool engaged) noexcept;

  /// Newest message, its echo by this side's clock; sequence 0 and all zero before the first.
  [[nodiscard]] const MasterMessage& message() const noexcept { return message_; }
  /// Its arrival, less what it came later than the quickest of late; kNever before the first.
  [[nodiscard]] Time message_at() const noexcept { return message_at_; }
  [[nodiscard]] Duration round_trip() const noexcept { return round_trip_; }
  [[nodiscard]] const LinkSession& session() const noexcept { return session_; }
  [[nodiscard]] std::uint32_t malformed() const noexcept { return malformed_; }
  /// As asked by the newest message, or by a stop or a release that came too late to be one.
  [[nodiscard]] bool enable() const noexcept { return message_.enable && !urgent_.release; }
  [[nodiscard]] bool stop() const noexcept { return message_.stop || urgent_.stop; }
  /// Set-point to act on, and what its age takes away.
  [[nodiscard]] const LossDecision& set_point() const noexcept { return set_point_; }
  /// That the operator chose in this step to go home on two; nullptr: not in this step.
  [[nodiscard]] const HomeMessage* home() const noexcept { return home_ ? &*home_ : nullptr; }
  /// Why the newest set-point is one that no hand can make; kNone where one can.
  [[nodiscard]] const Reason& not_by_hand() const noexcept { return not_by_hand_; }
  /// Likewise of one that came while the machine followed: the next message may look sound again, so this stays until
  /// enable is released.
  [[nodiscard]] const Reason& led_astray() const noexcept { return led_astray_; }

 private:
  void receive(Time now, const JointVector& machine_rad, bool engaged) noexcept;
  void take_home(const HomeMessage& home) noexcept;

  LinkInbox inbox_;
  LinkSession session_;
  SetPointLimits limits_;
  /// Stops and releases that have been acted on, and whether more have come since the last step's command.
  struct Urgent {
    std::uint32_t stops = 0, releases = 0;
    bool stop = false, release = false;
  } urgent_;
  MasterMessage message_;
  std::optional<HomeMessage> home_;
  std::uint32_t home_sequence_ = 0;  // of the newest one
  Time message_at_ = kNever;
  Duration round_trip_ = std::chrono::hours(1);
  SetPointMemory memory_;
  Reason not_by_hand_, led_astray_;
  LossDecision set_point_;
  std::uint32_t malformed_ = 0;
};

}  // namespace knuckle::slave
