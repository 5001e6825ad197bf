#include "app/console/operator_station.h"

#include <algorithm>

#include "app/session/loop_views.h"
#include "master/master_state.h"
#include "slave/loss_policy.h"

namespace knuckle::console {
namespace {

constexpr double kRamp_s = 0.25;          // from rest to full rate, and back
constexpr double kAlignRate_radps = 0.6;  // how fast a hand is brought to the machine's pose at most,
constexpr double kAlignGain_1ps = 4;      // slowing down as it comes near
constexpr double kMostPush_N = 6;         // a hand that moves on against a wall leans on it, no more
constexpr double kMostAhead_rad = 0.3;    // likewise for each joint: the wrist's spring
constexpr double kLongestStep_s = 0.01;   // a loop that has stood makes no jump
constexpr Duration kTakeHold = 300ms;     // the machine's side must see a hand before it sees enable pressed

bool aligns(const HandInput& held, const sim::OperatorView& seen) noexcept {
  const bool led = seen.mode == Mode::kEngaged || (seen.mode == Mode::kHold && held.clutch);
  const bool shown = seen.mode != Mode::kOff && seen.mode != Mode::kSelfTest;
  return held.enable && shown && !led;
}

}  // namespace

PersonHand::PersonHand(const DeviceDescription& device, const MachineDescription& machine,
                       const sim::LimbImpedance& limb) noexcept
    : kinematics_(device.link_m), most_ahead_m_(kMostPush_N / limb.stiffness_N_per_m) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto row = Eigen::Index(i);
    device_min_rad_[row] = device.min_rad[i];
    device_max_rad_[row] = device.max_rad[i];
    machine_min_rad_[row] = machine.links[i].min_rad;
    machine_max_rad_[row] = machine.links[i].max_rad;
  }
}

const sim::OperatorIntent& PersonHand::step(Time now, const HandInput& held, const sim::OperatorView& seen,
                                            double scale) noexcept {
  const double dt_s = std::clamp(to_seconds(now - last_), 0.0, kLongestStep_s);
  last_ = now;
  if (!held.presence || !intent_.presence) {
    took_hold_ = now;
    rate_radps_.setZero();
    intent_ = {};
    intent_.joint_rad = seen.hand_rad;
    intent_.presence = held.presence;
    return intent_;
  }
  intent_.clutch = held.clutch;
  intent_.enable = held.enable && now - took_hold_ >= kTakeHold;
  const JointVector before = intent_.joint_rad;
  const JointVector rate_radps = aligns(held, seen) ? aligning(seen, scale) : moving(held, seen, scale, dt_s);
  intent_.joint_rad = within_reach(before + dt_s * rate_radps, seen.hand_rad);
  intent_.rate_radps = dt_s > 0 ? JointVector((intent_.joint_rad - before) / dt_s) : JointVector(JointVector::Zero());
  return intent_;
}

/// Of the hand: towards where the ghost lies on the machine.
JointVector PersonHand::aligning(const sim::OperatorView& seen, double scale) const noexcept {
  const JointVector goal_rad = seen.hand_rad + (seen.machine_rad - seen.ghost_rad) / scale;
  const JointVector wanted = kAlignGain_1ps * (goal_rad - intent_.joint_rad);
  return wanted.cwiseMax(-kAlignRate_radps).cwiseMin(kAlignRate_radps);
}

/// Of the hand: as requested, rounded off; not further out where the machine cannot follow.
JointVector PersonHand::moving(const HandInput& held, const sim::OperatorView& seen, double scale,
                               double dt_s) noexcept {
  const JointVector most_change = (dt_s / kRamp_s) * kFullRate_radps;
  rate_radps_ += (held.rate_radps - rate_radps_).cwiseMax(-most_change).cwiseMin(most_change);
  for (int i = 0; i < kJoints; ++i) {
    const bool outwards = (seen.ghost_rad[i] >= machine_max_rad_[i] && rate_radps_[i] > 0) ||
                          (seen.ghost_rad[i] <= machine_min_rad_[i] && rate_radps_[i] < 0);
    if (outwards) rate_radps_[i] = 0;
  }
  return rate_radps_ / scale;
}

JointVector PersonHand::within_reach(const JointVector& joint_rad, const JointVector& hand_rad) const noexcept {
  JointVector ahead_rad = joint_rad.cwiseMax(device_min_rad_).cwiseMin(device_max_rad_) - hand_rad;
  const double ahead_m = (kinematics_.posture(hand_rad + ahead_rad).tip_m - kinematics_.posture(hand_rad).tip_m).norm();
  ahead_rad *= std::min(
      {1.0, most_ahead_m_ / std::max(ahead_m, 1e-9), kMostAhead_rad / std::max(ahead_rad.cwiseAbs().maxCoeff(), 1e-9)});
  return hand_rad + ahead_rad;
}

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
  view.hand = operator_side(state_of(now, side_.master), feel_.position_scale, feel_.force_scale);
  view.hand.ghost_rad = side_.master.set_point().unclamped_rad();
  show_link(now, view.link);
  if (side_.master.machine()) view.machine = *side_.master.machine();
  view.status_heard = side_.master.machine_status().has_value();
  view.status_age_s = to_seconds(now - side_.master.machine_status_at());
  if (view.status_heard) view.status = *side_.master.machine_status();
  view.readings = side_.master.machine_readings().value_or(MachineReadings{});
}

void OperatorStation::show_link(Time now, LinkSide& link) noexcept {
  if (now - shown_at_ >= kHistogramPeriod) {
    shown_at_ = now;
    watch_.show(shown_);
  }
  shown_.heard = side_.master.machine().has_value();
  shown_.silence_s = side_.master.silence_s();
  shown_.neutral_after_s = to_seconds(slave::kLossLimits.neutral);
  shown_.round_trip_s = side_.master.round_trip_s();
  link = shown_;
}

}  // namespace knuckle::console
