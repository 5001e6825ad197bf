#include "slave/home_on_two.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "slave/modes.h"

namespace knuckle::slave {
namespace {

constexpr Duration kDoubted = 10s;  // what is seen to be pressed, after a transmitter contradicted the others

/// A sensor or its node has failed, as opposed to being another one than the file says, or there twice.
bool is_failure(ReasonCode code) noexcept {
  constexpr std::array kFailures{ReasonCode::kSensorStale, ReasonCode::kSensorInvalid, ReasonCode::kSensorImplausible,
                                 ReasonCode::kFrameShort,  ReasonCode::kNodeSilent,    ReasonCode::kNodeEmergency,
                                 ReasonCode::kNodeFault,   ReasonCode::kNodeSetup};
  return std::find(kFailures.begin(), kFailures.end(), code) != kFailures.end();
}

}  // namespace

bool only_pressures_of(int joint, const NodeDescription& node) noexcept {
  return !node.channels.empty() && std::all_of(node.channels.begin(), node.channels.end(), [&](const NodeChannel& c) {
    return c.info().role == NodeRole::kPressure && c.info().index / 2 == joint;
  });
}

HomeOnTwo::HomeOnTwo(const MachineDescription& machine)
    : bus_(machine.bus),
      possible_(machine.sensors.without_pressures == SensorDescription::kNone &&
                machine.limits.chamber_pressure_Pa >= machine.hydraulics.main_relief_Pa) {}

std::optional<int> HomeOnTwo::cylinder_of(const Reason& fault) const noexcept {
  if (!possible_ || stage_ != Stage::kNothing || !is_failure(fault.code)) return std::nullopt;
  if (const auto place = signal_of(fault)) {
    const SignalInfo& signal = kSignals[*place];
    return signal.role == NodeRole::kPressure ? std::optional(signal.index / 2) : std::nullopt;
  }
  const NodeDescription* node = bus_.find(fault.subject);
  for (int joint = 0; node != nullptr && joint < kJoints; ++joint)
    if (only_pressures_of(joint, *node)) return joint;
  return std::nullopt;
}

bool HomeOnTwo::hindered_by(const Reason& fault) const noexcept {
  return stage_ == Stage::kOffered && is_failure(fault.code);
}

void HomeOnTwo::note_pressed(bool pressed, Time now) noexcept {
  if (stage_ != Stage::kNothing || now - contradicted_at_ < kDoubted) return;
  pressed_ = pressed;
  pressed_before_[0] = pressed_before_[0] || pressed;
  if (now - noted_at_ < 1s) return;
  noted_at_ = now;
  pressed_before_ = {pressed, pressed_before_[0], pressed_before_[1]};
}

void HomeOnTwo::note_contradiction(const Reason& fault, Time now) noexcept {
  if (fault.code != ReasonCode::kSensorImplausible || !cylinder_of(fault)) return;
  if (now - contradicted_at_ >= kDoubted) pressed_ = pressed_before_[2];
  contradicted_at_ = now;
}

void HomeOnTwo::offer(int joint) noexcept {
  stage_ = Stage::kOffered;
  joint_ = joint;
  calm_since_ = refused_at_ = kNever;
}

void HomeOnTwo::withdraw() noexcept {
  stage_ = Stage::kNothing;
}

void HomeOnTwo::look(const Machine& machine, Time now) noexcept {
  machine_ = machine;
  const bool stands = (machine.rate_radps.array().abs() <= kModeLimits.machine_radps).all();  // a NaN does not
  const bool calm = offered() && stands && !machine.pressed;
  if (!calm)
    calm_since_ = kNever;
  else if (calm_since_ == kNever)
    calm_since_ = now;
}

/// What was pressed when the transmitters failed counts as pressed still: the machine has stood since, and two torques
/// may be blind to it.
Reason HomeOnTwo::refusal() const noexcept {
  if (machine_.enable) return {ReasonCode::kEnableHeld};
  if (const Reason moving = beyond(ReasonCode::kMachineMoving, machine_.rate_radps, kModeLimits.machine_radps))
    return moving;
  if (!machine_.pressed && !pressed_) return {};
  return {ReasonCode::kHomePressed, joint_};
}

void HomeOnTwo::choose(unsigned cylinder, Time now) noexcept {
  if (!offered() || cylinder != 1U << joint_) return;
  refused_ = refusal();
  refused_at_ = now;
  if (!refused_ && calm_since_ != kNever && now - calm_since_ >= kLookedAt) stage_ = Stage::kChosen;
}

Reason HomeOnTwo::blocking(Time now) const noexcept {
  if (stage_ != Stage::kOffered) return {};
  if (refused_ && now - refused_at_ < kRefusalShown) return refused_;
  return {ReasonCode::kHomeOffered, joint_};
}

}  // namespace knuckle::slave
