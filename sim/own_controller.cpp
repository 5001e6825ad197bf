#include "sim/own_controller.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"

namespace knuckle::sim {
namespace {

constexpr double kRateFilter_s = 0.02;
constexpr double kSlowest_radps = 0.002;              // what is less is not asked for
constexpr double kProportional = 0.6, kIntegral = 4;  // of full opening per share of full speed, and a second

}  // namespace

OwnController::OwnController(const MachineDescription& machine)
    : kind_(machine.bus.command_kind), patience_(from_seconds(machine.bus.valve_watchdog_s)) {
  for (const CommandFrame& frame : machine.bus.commands) frames_.push_back({.frame = frame});
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto i = static_cast<std::size_t>(joint);
    const CylinderDescription& cylinder = machine.cylinders[i];
    const LinkDescription& link = machine.links[i];
    const double lever_m = (cylinder.max_length_m - cylinder.min_length_m) / (link.max_rad - link.min_rad);
    const double flow_m3ps = cylinder.valve.nominal_flow_m3ps *
                             std::sqrt(machine.hydraulics.load_sensing_margin_Pa / cylinder.valve.nominal_drop_Pa);
    for (const bool extend : {false, true}) {
      const double area_m2 = extend ? cylinder.head_area_m2() : cylinder.rod_side_area_m2();
      axes_[i].dead_band[extend ? 1 : 0] = cylinder.valve.dead_band(extend);
      axes_[i].full_opening_radps[extend ? 1 : 0] = flow_m3ps / area_m2 / lever_m;
      full_rate_radps_[extend ? 1 : 0][joint] = machine.bus.full_rate_radps(joint, extend);
    }
  }
}

/// What its counter or checksum says to be old or damaged is not heard.
void OwnController::hear(const CanFrame& frame, Time now) noexcept {
  for (Heard& heard : frames_) {
    if (heard.frame.id != frame.id || frame.size < heard.frame.bytes) continue;
    const FrameCheck check = check_frame(heard.frame.closing, heard.count, frame);
    heard.count = check.count;
    if (check.fault != FrameFault::kNone && check.fault != FrameFault::kCounterSkipped) continue;
    heard.newest = frame;
    heard.at = now;
  }
}

bool OwnController::fresh(Time now) const noexcept {
  return std::all_of(frames_.begin(), frames_.end(), [&](const Heard& heard) {
    const Duration most = std::max(patience_, from_seconds(3 * heard.frame.period_s));
    return heard.at != kNever && now - heard.at <= most;
  });
}

/// Every constant says what it says while somebody leads.
bool OwnController::led() const noexcept {
  return std::all_of(frames_.begin(), frames_.end(), [](const Heard& heard) {
    return std::all_of(heard.frame.fields.begin(), heard.frame.fields.end(), [&](const CommandField& field) {
      if (field.joint || field.led == field.neutral) return true;
      return read_raw(field.bits, heard.newest) == raw_of(field.bits, field.led);
    });
  });
}

/// Share of the full command, [-1, 1], positive extends.
double OwnController::asked(int joint) const noexcept {
  double share = 0;
  for (const Heard& heard : frames_) {
    for (const CommandField& field : heard.frame.fields) {
      if (field.joint != joint) continue;
      const double above = read_value(field.bits, heard.newest).value_or(field.neutral) - field.neutral;
      if (field.extend) share += std::max(0.0, above / (*field.extend - field.neutral));
      if (field.retract) share -= std::max(0.0, above / (*field.retract - field.neutral));
    }
  }
  return std::clamp(share, -1.0, 1.0);
}

/// Its speed by the valve's data, and what that lacks by the speed seen.
double OwnController::spool_for(Axis& axis, int joint, double share) noexcept {
  const std::size_t way = share > 0 ? 1 : 0;
  const double full_radps = full_rate_radps_[way][joint], wanted_radps = share * full_radps;
  if (std::abs(wanted_radps) < kSlowest_radps) {
    axis.sum = 0;
    return 0;
  }
  const double error = (wanted_radps - axis.rate_radps) / full_radps, direction = share > 0 ? 1 : -1;
  axis.sum = std::clamp(axis.sum + kIntegral * to_seconds(kPeriod) * error, -1.0, 1.0);
  const double open = wanted_radps / axis.full_opening_radps[way] + kProportional * error + axis.sum;
  const double opening =
      std::clamp(direction * open, 0.0, 1.0);  // a load that runs ahead is throttled, not driven back
  return direction * (axis.dead_band[way] + (1 - axis.dead_band[way]) * opening);
}

void OwnController::step(Time now, const JointVector& shaft_rad, const JointVector& cylinder_mps) noexcept {
  const bool hears = fresh(now) && !estop_;
  pilot_ = hears && led();
  if (!pilot_) {
    spool_demand_.setZero();
    for (Axis& axis : axes_) axis.sum = 0;
  }
  if (controlled_at_ != kNever && now - controlled_at_ < kPeriod) return;
  const double passed_s = controlled_at_ == kNever ? 0 : to_seconds(now - controlled_at_);
  controlled_at_ = now;
  for (int joint = 0; joint < kJoints; ++joint) {
    Axis& axis = axes_[static_cast<std::size_t>(joint)];
    if (passed_s > 0) {
      const double seen = std::abs(shaft_rad[joint] - axis.last_rad) / passed_s;
      const double share = 1 - std::exp(-passed_s / kRateFilter_s);
      axis.rate_radps += share * (std::copysign(seen, cylinder_mps[joint]) - axis.rate_radps);
    }
    axis.last_rad = shaft_rad[joint];
    if (!pilot_) continue;
    const double share = asked(joint);
    spool_demand_[joint] = kind_ == CommandKind::kJointRate ? spool_for(axis, joint, share) : share;
  }
}

}  // namespace knuckle::sim
