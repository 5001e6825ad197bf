#include "machine/encoder_length.h"

#include <cmath>
#include <numbers>

#include "machine/description.h"
#include "machine/room.h"

namespace knuckle {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;

}  // namespace

EncoderLengths::EncoderLengths(const MachineDescription& machine) {
  const JointVector middle_rad = middle_of_range(machine);
  for (int joint = 0; joint < kJoints; ++joint) {
    if (!machine.bus.measures_angle(joint)) continue;
    Shaft& shaft = shafts_[static_cast<std::size_t>(joint)] = {.is_there = true, .middle_rad = middle_rad[joint]};
    if (machine.bus.broadcast(NodeRole::kEncoder, joint).field == nullptr) {
      const RotaryDescription& rotary = machine.bus.encoder(joint).rotary;
      shaft.sign = rotary.sign;
      shaft.zero_rad = rotary.zero_rad;
      shaft.range_rad = kTurn_rad * rotary.turns;
    }
    if (!drawing_) drawing_.emplace(as_drawn(machine));
  }
}

std::optional<double> EncoderLengths::length_m(int joint, double reading) const noexcept {
  const Shaft& shaft = shafts_[static_cast<std::size_t>(joint)];
  if (!shaft.is_there) return reading;
  if (!(shaft.sign * (reading - shaft.zero_rad) < shaft.range_rad)) return std::nullopt;  // broken ones count all bits
  const bool turns = std::isfinite(shaft.range_rad);  // of what the machine sends any other angle is a wrong one
  const double angle_rad = turns ? shaft.middle_rad + std::remainder(reading - shaft.middle_rad, kTurn_rad) : reading;
  const auto cylinder = drawing_->cylinder_at(joint, angle_rad);
  if (!cylinder) return std::nullopt;
  // Beyond the joint's range a length is that of another angle, or of none.
  constexpr double kSame_rad = 1e-6;
  const auto its_angle_rad = drawing_->joint_at(joint, cylinder->length_m);
  if (!its_angle_rad || std::abs(*its_angle_rad - angle_rad) > kSame_rad) return std::nullopt;
  return cylinder->length_m;
}

std::optional<double> EncoderLengths::reading(int joint, double length_m) const noexcept {
  const Shaft& shaft = shafts_[static_cast<std::size_t>(joint)];
  if (!shaft.is_there) return length_m;
  const auto angle_rad = drawing_->joint_at(joint, length_m);
  if (!angle_rad) return std::nullopt;
  const double shown_rad = std::fmod(shaft.sign * (*angle_rad - shaft.zero_rad), kTurn_rad);
  return shaft.zero_rad + shaft.sign * (shown_rad < 0 ? shown_rad + kTurn_rad : shown_rad);
}

JointVector length_steps_m(const MachineDescription& machine) {
  JointVector steps_m = JointVector::Constant(machine.sensors.encoder_step_m);
  std::optional<Kinematics> kinematics;
  for (int joint = 0; joint < kJoints; ++joint) {
    const BroadcastField* const sent = machine.bus.broadcast(NodeRole::kEncoder, joint).field;
    const bool counts = sent != nullptr && sent->bits.type != BitField::Type::kFloat;
    if (sent != nullptr) steps_m[joint] = counts ? std::abs(sent->bits.scale) : 0;
    if (!machine.bus.measures_angle(joint)) continue;
    if (!kinematics) kinematics.emplace(machine);
    const double step_rad = sent != nullptr ? steps_m[joint] : machine.bus.encoder(joint).rotary.step_rad();
    steps_m[joint] = step_rad * lever_range(machine, *kinematics, joint).longest_m;
  }
  return steps_m;
}

}  // namespace knuckle
