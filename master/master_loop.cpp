// One step of the operator's side.
#include "master/master_loop.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "transport/link_header.h"

namespace knuckle::master {
namespace {

constexpr double kStep_s = 1e-3;
constexpr double kRoundTripBlend = 0.05;  // per message: about 0.1 s at 200 Hz
constexpr double kRoundTripBelieved_s = 5;
constexpr double kLostBlend = 0.005;  // per message: 1 s at 200 Hz
constexpr double kMostMissing = 2000;
constexpr Duration kTimeToTell = 1s;  // its machine: twenty times what it takes
constexpr int kLettingGoSteps = 100;  // an end takes
constexpr std::uint32_t kHomeEveryMessages = 5;
constexpr double kBelieved_s = 0.5;  // a mode, after the last message: the machine has stopped by itself long ago

}  // namespace

MasterLoop::MasterLoop(const DeviceDescription& device, const MachineDescription& machine, HidPort& port, Link& link,
                       const LinkStart& start, ControlLaw law, FarEnd far_end) noexcept
    : feel_(device.feel),
      machine_name_(machine.name),
      far_end_(far_end),
      link_(link),
      driver_(device, port),
      kinematics_(device.link_m),
      set_point_(machine),
      walls_(device, machine),
      felt_(law, device.feel),
      limiter_(device),
      force_scale_(device.feel.force_scale),
      inbox_(link),
      session_(start, kRestartSilence) {}

void MasterLoop::step(Time now) noexcept {
  const DeviceReading& device = driver_.step(now);
  receive(now);
  set_point_.step(device, machine_mode(), slave_ ? &slave_->position_rad : nullptr);
  posture_ = kinematics_.posture(set_point_.position_rad());
  render(device);
  driver_.command(torque_Nm_);
  send_now_ = !send_now_;
  const bool urgent = count_urgent(device);
  if (send_now_ || urgent) send(device, now);
  ask_for_home(device, now);
  if (settings_.let_go && !has_let_go()) ++steps_since_let_go_;
}

void MasterLoop::let_go() noexcept {
  settings_.let_go = true;
  driver_.let_go();
}

bool MasterLoop::has_let_go() const noexcept {
  return steps_since_let_go_ >= kLettingGoSteps;
}

void MasterLoop::receive(Time now) noexcept {
  inbox_.begin_step(now);
  while (inbox_.next(incoming_)) {
    if (first_heard_at_ == kNever) first_heard_at_ = now;
    const auto kind = link_kind(incoming_.view());
    if (kind == LinkKind::kSlave) {
      if (const auto message = decode_slave(incoming_.view())) take(*message, inbox_.arrival(incoming_), now);
    } else if (kind == LinkKind::kStatus) {
      if (const auto status = decode_status(incoming_.view())) take(*status, now);
    } else if (kind == LinkKind::kReadings) {
      if (const auto message = decode_readings(incoming_.view())) take(*message);
    }
  }
  silence_s_ = to_seconds(now - slave_at_);
  if (silence_s_ >= kBelieved_s) readings_.reset();
  other_machine_ = judge_far_end(now);
}

void MasterLoop::take(SlaveMessage message, Time arrived, Time now) noexcept {
  const LinkSession::Verdict verdict = session_.take(message.stamp, arrived);
  if (verdict == LinkSession::Verdict::kForeign) return;
  if (tap_.on_message != nullptr) tap_.on_message(tap_.context, message);
  if (verdict == LinkSession::Verdict::kOld) return;
  if (verdict == LinkSession::Verdict::kBegins) {
    if (slave_) first_heard_at_ = now;
    status_.reset();  // it may be another machine
    status_at_ = kNever;
  }
  if (verdict == LinkSession::Verdict::kBegins || now - slave_at_ >= kRestartSilence) {
    lost_share_ = 0;
  } else {
    count_lost(message.stamp.sequence);
  }
  slave_ = message;
  slave_at_ = arrived;
  const double sample_s = to_seconds(now - message.stamp.echoed);
  if (sample_s >= 0 && sample_s < kRoundTripBelieved_s) {
    round_trip_s_ += (sample_s - round_trip_s_) * (heard_ ? kRoundTripBlend : 1);
    heard_ = true;
  }
}

/// Share of the machine's messages, of late, that nothing came of: lost, or overtaken by newer ones.
void MasterLoop::count_lost(std::uint32_t sequence) noexcept {
  const double missing = std::min(kMostMissing, static_cast<double>(sequence - slave_->stamp.sequence) - 1);
  lost_share_ = 1 - (1 - lost_share_) * std::pow(1 - kLostBlend, missing);
  lost_share_ -= kLostBlend * lost_share_;
}

void MasterLoop::take(const MachineStatus& status, Time now) noexcept {
  if (!session_.of_far(status.stamp) || (status_ && !newer(status.stamp.sequence, status_->stamp.sequence))) return;
  status_ = status;
  status_->acted_report_at = session_.from_link(status.acted_report_at);
  status_at_ = now;
}

/// An older one that comes late is a second old: it does not matter.
void MasterLoop::take(const ReadingsMessage& message) noexcept {
  if (session_.of_far(message.stamp)) readings_ = message.readings();
}

bool MasterLoop::same_machine() const noexcept {
  return far_end_ == FarEnd::kIsThisMachine || (status_ && status_->machine == machine_name_);
}

/// As last heard, but not for ever.
Mode MasterLoop::machine_mode() const noexcept {
  return slave_ && silence_s_ < kBelieved_s ? slave_->mode : Mode::kOff;
}

bool MasterLoop::leads() const noexcept {
  return !settings_.nobody && !settings_.let_go && same_machine();
}

Reason MasterLoop::judge_far_end(Time now) const noexcept {
  if (same_machine()) return {};
  if (status_) return {ReasonCode::kOtherMachine, 0, 0, 0};
  const bool silent = first_heard_at_ != kNever && now - first_heard_at_ > kTimeToTell;
  return {silent ? ReasonCode::kMachineNotTold : ReasonCode::kNone, 0, 0, 0};
}

FeltInputs MasterLoop::felt_inputs() const noexcept {
  // Machine joints through the device's links, shrunk where a joint moves more than one to one: positions as the hand
  // would make them, so that J(set-point)^T gives device torques.
  const double shrink = 1 / set_point_.scale();
  FeltInputs in;
  in.hand_m = shrink * posture_.tip_m;
  in.hand_mps = posture_.jacobian * driver_.reading().rate_radps;
  in.round_trip_s = round_trip_s_;
  in.silence_s = silence_s_;
  in.lost_share = lost_share_;
  if (!slave_) return in;
  const DevicePosture machine = kinematics_.posture(slave_->position_rad);
  in.machine_m = shrink * machine.tip_m;
  in.machine_mps = shrink * (machine.jacobian * slave_->velocity_radps);
  in.ahead_m = shrink * (machine.jacobian * slave_->ahead_rad);
  in.reflected_N = force_scale_ * slave_->tip_force_N;
  in.load_N = force_scale_ * slave_->load_N;
  // Of the force's size: along its own direction, as the estimate is far better across some postures than along them.
  const auto& [xx, xz, zz] = slave_->covariance_N2;
  const PlanarVector direction = slave_->tip_force_N.stableNormalized();
  const double variance_N2 =
      xx * direction.x() * direction.x() + 2 * xz * direction.x() * direction.y() + zz * direction.y() * direction.y();
  in.sigma_N = force_scale_ * std::sqrt(std::max(0.0, variance_N2));
  in.contact_compliance = slave_->contact_compliance;
  in.confidence = slave_->confidence;
  in.engaged =
      slave_->mode == Mode::kEngaged && driver_.reading().presence && leads();  // laws judge silence themselves
  return in;
}

void MasterLoop::render(const DeviceReading& device) noexcept {
  const FeltInputs in = felt_inputs();
  law_force_N_ = energy_.gain() * felt_.step(in, kStep_s);
  rendered_N_ = energy_.gain() * felt_.rendered_N();
  if (!device.ok || settings_.let_go) {  // the firmware takes the torque away by itself, without a kick
    torque_Nm_.setZero();
    rendered_N_.setZero();
    limiter_.rest(kStep_s);
    return;
  }
  JointVector wanted_Nm = posture_.jacobian.transpose() * law_force_N_;
  if (in.engaged && machine_mode() == Mode::kEngaged) {
    wanted_Nm +=
        energy_.gain() * walls_.torque(set_point_.unclamped_rad(), JointVector(set_point_.scale() * device.rate_radps));
  }
  energy_.step(torque_Nm_.dot(device.rate_radps), kStep_s);  // of the torque that acted until now
  torque_Nm_ = limiter_.step(wanted_Nm, posture_.jacobian, kStep_s);
  rendered_N_ *= limiter_.share();
}

/// @return whether Stop was pressed since the last step, or enable released, or whoever pressed it ceased to lead.
bool MasterLoop::count_urgent(const DeviceReading& device) noexcept {
  const bool stopped = stop() && !stopping_;
  const bool released = (enabled_ && !device.enable) || (leads_ && !leads());
  leads_ = leads();
  enabled_ = device.enable;
  stopping_ = stop();
  if (stopped) ++stops_;
  if (released) ++releases_;
  return stopped || released;
}

void MasterLoop::send(const DeviceReading& device, Time now) noexcept {
  MasterMessage message;
  message.stamp = session_.stamp(++sequence_, now);
  message.device_report_at = session_.to_link(std::max(device.measured_at, Time{}));
  message.stops = stops_;
  message.releases = releases_;
  message.presence = leads_ && device.presence;
  message.enable = leads_ && device.enable;
  message.clutch = leads_ && device.clutch;
  message.stop = stop();
  message.device_ok = device.ok;
  message.device_reason = device.reason;
  message.position_rad = set_point_.position_rad();
  message.velocity_radps = set_point_.velocity_radps();
  message.rendered_N = rendered_N_ / force_scale_;
  message.assist = settings_.assist;
  link_.send(encode(message).view());
}

/// Only while the machine offers it, and with enable released: the clutch held, or what was set from outside.
void MasterLoop::ask_for_home(const DeviceReading& device, Time now) noexcept {
  const bool offered = machine_mode() != Mode::kOff && slave_->home_offered && leads();
  const bool asked = settings_.home || (device.ok && device.presence && device.clutch);
  may_ask_home_ = offered && (may_ask_home_ || !asked);
  home_steps_ = may_ask_home_ && asked && !device.enable ? std::min(home_steps_ + 1, kHomeSteps) : 0;
  if (home_steps_ < kHomeSteps || sequence_ % kHomeEveryMessages != 0 || !send_now_) return;
  HomeMessage message;
  message.stamp = session_.stamp(++home_sequence_, now);
  message.cylinder = slave_->unknown_torques;
  link_.send(encode(message).view());
}

bool MasterLoop::set_scales(double position_scale, double force_scale) noexcept {
  const double stiffer = position_scale / feel_.position_scale * (force_scale / feel_.force_scale);
  const bool usable = position_scale > 0 && force_scale > 0 && stiffer <= kStiffest * (1 + 1e-9);  // a NaN is not
  // The machine's report is older by the way back: enable is the first to show it.
  if (!usable || driver_.reading().enable || led(machine_mode())) return false;
  settings_.position_scale = position_scale;
  settings_.force_scale = force_scale_ = force_scale;
  set_point_.set_scale(position_scale / feel_.position_scale);
  felt_.set_spring(feel_.spring_N_per_m * stiffer);
  return true;
}

Reason MasterLoop::warning() const noexcept {
  if (energy_.gain() < 1)
    return {ReasonCode::kEnergyWatchdog, 0, static_cast<float>(energy_.returned_in_window_J()),
            static_cast<float>(EnergyPort::kReturnedLimit_J)};
  if (limiter_.heat_share() < 1)
    return {ReasonCode::kMotorHeat, 0, static_cast<float>(100 * limiter_.heat_share()), 100};
  return felt_.downgraded();
}

}  // namespace knuckle::master
