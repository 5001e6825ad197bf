#include "slave/operator_input.h"

#include <algorithm>

#include "machine/description.h"

namespace knuckle::slave {

OperatorInput::OperatorInput(const MachineDescription& machine, Link& link, const LinkStart& start)
    : inbox_(link), session_(start, kLossLimits.neutral), limits_(machine) {}

void OperatorInput::step(Time now, const std::optional<JointVector>& machine_rad, bool engaged) noexcept {
  const JointVector machine = machine_rad.value_or(limits_.min_rad);  // not known: somewhere in the working range
  const Duration gap = now - message_at_;                             // before anything new is taken
  receive(now, machine, engaged);
  if (!enable()) led_astray_ = {};
  set_point_ = loss_policy(message_.position_rad, message_.velocity_radps, now - message_at_, gap, round_trip_,
                           static_cast<bool>(set_point_.hold));
  set_point_.position_rad = limits_.clamped(set_point_.position_rad, machine);  // nor does extrapolating lead beyond
}

/// Newest wins: whatever is older than what is known is no command, however long nothing newer has come; nor is what
/// has been under way for as long as makes a link count as lost, however new. A stop or a release is obeyed however
/// late.
void OperatorInput::receive(Time now, const JointVector& machine_rad, bool engaged) noexcept {
  inbox_.begin_step(now);
  Urgent urgent = urgent_;
  urgent.stop = urgent.release = false;
  bool commanded = false;
  home_.reset();
  for (Datagram datagram; inbox_.next(datagram);) {
    if (const auto home = decode_home(datagram.view())) {
      take_home(*home);
      continue;
    }
    auto message = decode_master(datagram.view());
    if (!message) {
      ++malformed_;
      continue;
    }
    const Time arrived = inbox_.arrival(datagram);
    const LinkSession::Verdict verdict = session_.take(message->stamp, arrived);
    if (verdict != LinkSession::Verdict::kNews && verdict != LinkSession::Verdict::kBegins) continue;
    if (verdict == LinkSession::Verdict::kBegins) {
      memory_ = {};
      home_sequence_ = 0;
    } else {
      urgent.stop = urgent.stop || message->stops != urgent.stops;
      urgent.release = urgent.release || message->releases != urgent.releases;
    }
    urgent.stops = message->stops;
    urgent.releases = message->releases;
    const Duration age = now - arrived + session_.late();
    if (age >= kLossLimits.neutral) continue;
    message_ = *message;
    message_at_ = now - age;
    round_trip_ = std::max(Duration::zero(), now - message_.stamp.echoed);
    const SetPointVerdict judged = check_set_point(message_, memory_, limits_, machine_rad);
    memory_ = judged.memory;
    not_by_hand_ = judged.reason;
    if (engaged && !led_astray_) led_astray_ = judged.reason;
    commanded = true;
  }
  // Without a newer command the last one would undo them.
  urgent.stop = urgent.stop || (urgent_.stop && !commanded);
  urgent.release = urgent.release || (urgent_.release && !commanded);
  urgent_ = urgent;
}

/// A choice counts only if it was made just now, which the newest command shows: one that was held up on its way is
/// none.
void OperatorInput::take_home(const HomeMessage& home) noexcept {
  if (!session_.of_far(home.stamp) || !newer(home.stamp.sequence, home_sequence_)) return;
  home_sequence_ = home.stamp.sequence;
  const Duration older = message_.stamp.sent_at - home.stamp.sent_at;
  if (older > -kLossLimits.neutral && older < kLossLimits.neutral) home_ = home;
}

}  // namespace knuckle::slave
