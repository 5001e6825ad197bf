#include "app/console/operator_station.h"

#include <algorithm>

#include "app/session/loop_views.h"
#include "slave/loss_policy.h"

namespace knuckle::console {
namespace {

constexpr Duration kHistogramPeriod = 200ms;

}  // namespace

OperatorStation::OperatorStation(const StationSetup& setup, Link& link, HidPort* device)
    : feel_(setup.side.device.feel),
      scales_{feel_.position_scale, feel_.force_scale},
      start_rad_(setup.start_rad),
      person_(setup.side.device, setup.side.machine, setup.limb),
      watch_(from_seconds(1 / setup.side.machine.bus.sync_Hz)),
      side_(setup.side,
            device != nullptr ? *device
                              : hand_.emplace(setup.side.device, setup.limb, setup.seed, setup.hand_rad).cable.host(),
            link) {
  side_.master.set_tap(
      {[](void* watch, const SlaveMessage& message) { static_cast<LinkWatch*>(watch)->note(message); }, &watch_});
}

void OperatorStation::step(Time now, const HandInput& held) noexcept {
  if (!hand_) return step_master(now);
  const sim::OperatorView seen = session::person_view(session::view_of(now, side_.master), start_rad_, hand(), 0);
  step(now, person_.step(now, held, seen, side_.master.set_point().scale()));
}

void OperatorStation::step(Time now, const sim::OperatorIntent& intent) noexcept {
  hand_->step(now, intent);
  step_master(now);
}

void OperatorStation::step_master(Time now) noexcept {
  watch_.stamp(now);
  side_.step(now);
  if (side_.master.machine_status_at() == now) watch_.note(*side_.master.machine_status());
}

ScalesAnswer OperatorStation::set_scales(double position_scale, double force_scale) noexcept {
  const double position =
      position_scale > 0 ? std::clamp(position_scale, kLeastPositionScale, kMostPositionScale) : feel_.position_scale;
  const double wanted =
      force_scale > 0 ? std::clamp(force_scale, kLeastForceScale, kMostForceScale) : feel_.force_scale;
  const double stiffest = master::MasterLoop::kStiffest * feel_.position_scale * feel_.force_scale;
  const double force = std::min(wanted, stiffest / position);
  if (position == scales_.position && force == scales_.force) return ScalesAnswer::kAsTheyAre;
  if (!side_.master.set_scales(position, force)) return ScalesAnswer::kLocked;
  scales_ = {position, force};
  return ScalesAnswer::kTaken;
}

void OperatorStation::show(Time now, ConsoleView& view) noexcept {
  view.now = now;
  OperatorSide& hand = view.hand;
  const master::DeviceReading& device = side_.master.device();
  const Reason other_machine = side_.master.other_machine();
  hand.device = other_machine ? other_machine : device.reason;
  hand.presence = device.presence;
  hand.enable = device.enable;
  hand.clutch = device.clutch;
  hand.stop = side_.master.stop();
  hand.ghost_rad = side_.master.set_point().unclamped_rad();
  hand.set_point_rad = side_.master.set_point().position_rad();
  hand.sent_force_N = side_.master.sent_force_N();
  hand.position_scale = side_.master.position_scale();
  hand.force_scale = side_.master.force_scale();
  hand.assist = side_.master.assist();
  hand.warning = side_.master.warning();
  hand.hand_energy_J = side_.master.energy().out_J() - side_.master.energy().in_J();
  show_link(now, view.link);
  if (side_.master.machine()) view.machine = *side_.master.machine();
  view.status_heard = side_.master.machine_status().has_value();
  view.status_age_s = to_seconds(now - side_.master.machine_status_at());
  if (view.status_heard) view.status = *side_.master.machine_status();
}

void OperatorStation::show_link(Time now, LinkSide& link) noexcept {
  if (now - shown_at_ >= kHistogramPeriod) {
    shown_at_ = now;
    shown_.round_trip = watch_.round_trip();
    shown_.arrival_jitter = watch_.arrival_jitter();
    shown_.hand_to_valve = watch_.hand_to_valve();
    shown_.loss = watch_.loss();
  }
  shown_.heard = side_.master.machine().has_value();
  shown_.silence_s = side_.master.silence_s();
  shown_.neutral_after_s = to_seconds(slave::kLossLimits.neutral);
  shown_.round_trip_s = side_.master.round_trip_s();
  link = shown_;
}

}  // namespace knuckle::console
