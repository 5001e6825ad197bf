#include "sim/own_controller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "machine/description.h"

namespace knuckle::sim {
namespace {

constexpr double kRateFilter_s = 0.02;
constexpr double kSlowest_radps = 0.002;  // what is less is not asked for
constexpr double kLoadFilter_s = 0.13;
constexpr double kIntegral = 0.1;  // of full opening per share of full speed and a second
constexpr double kLeastLever_m = 0.02;
constexpr double kLeastDrop_Pa = 3e5;  // it never divides by less

}  // namespace

OwnController::OwnController(const MachineDescription& machine)
    : kind_(machine.bus.command_kind),
      patience_(from_seconds(machine.bus.valve_watchdog_s)),
      margin_Pa_(machine.hydraulics.load_sensing_margin_Pa),
      relief_Pa_(machine.hydraulics.main_relief_Pa),
      stage_(machine) {
  for (const CommandFrame& frame : machine.bus.commands) frames_.push_back({.frame = frame});
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto i = static_cast<std::size_t>(joint);
    const CylinderDescription& cylinder = machine.cylinders[i];
    Axis& axis = axes_[i];
    axis.valve = cylinder.valve;
    axis.valve_gain = cylinder.valve.nominal_flow_m3ps / std::sqrt(cylinder.valve.nominal_drop_Pa);
    axis.head_m2 = cylinder.head_area_m2();
    axis.rod_m2 = cylinder.rod_side_area_m2();
    for (const bool extend : {false, true})
      full_rate_radps_[extend ? 1 : 0][joint] = machine.bus.full_rate_radps(joint, extend);
  }
}

void OwnController::measured(const PerJoint<ValveRoughness>& valves) noexcept {
  for (std::size_t i = 0; i < kJoints; ++i) {
    ValveDescription& valve = axes_[i].valve;
    valve.curve_exponent = valves[i].curve_exponent;
    valve.retract_share = valves[i].retract_gain;
    valve.notch_opening = valves[i].notch_opening;
    valve.notch_slope = valves[i].notch_slope;
  }
}

/// What its counter or checksum says to be old or damaged is not heard.
void OwnController::hear(const CanFrame& frame, Time now, bool from_bus) noexcept {
  for (Heard& heard : frames_) {
    if ((heard.frame.module == 0) != from_bus) continue;
    if (heard.frame.id != frame.id || frame.size < heard.frame.bytes) continue;
    const FrameCheck check = check_frame(heard.frame.closing, heard.count, frame);
    heard.count = check.count;
    if (check.fault != FrameFault::kNone && check.fault != FrameFault::kCounterSkipped) continue;
    heard.newest = frame;
    heard.at = now;
  }
}

bool OwnController::fresh(Time now) const noexcept {
  return std::all_of(frames_.begin(), frames_.end(),
                     [&](const Heard& heard) { return heard.at != kNever && now - heard.at <= patience_; });
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
      if (field.direction) {
        // The valve is blocked by any other way; it has no float.
        const auto way = read_raw(field.direction->bits, heard.newest);
        if (way == field.direction->extend) share += std::max(0.0, above / (*field.extend - field.neutral));
        if (way == field.direction->retract) share -= std::max(0.0, above / (*field.retract - field.neutral));
        continue;
      }
      if (field.extend) share += std::max(0.0, above / (*field.extend - field.neutral));
      if (field.retract) share -= std::max(0.0, above / (*field.retract - field.neutral));
    }
  }
  return std::clamp(share, -1.0, 1.0);
}

/// Oil goes in through one edge and out through the other, both as far open: what drives it is the pump's pressure on
/// the one side, less the load and the other side's.
double OwnController::full_opening_radps(const Axis& axis, bool extend) const noexcept {
  double highest_Pa = axis.load_Pa[extend ? 0 : 1];  // of what the pump feeds
  for (int joint = 0; joint < kJoints; ++joint) {
    const Axis& other = axes_[static_cast<std::size_t>(joint)];
    if (spool_demand_[joint] != 0) highest_Pa = std::max(highest_Pa, other.load_Pa[spool_demand_[joint] > 0 ? 0 : 1]);
  }
  const double supply_Pa = std::min(highest_Pa + margin_Pa_, relief_Pa_);
  const double in_m2 = extend ? axis.head_m2 : axis.rod_m2, out_m2 = extend ? axis.rod_m2 : axis.head_m2;
  const double in_Pa = axis.load_Pa[extend ? 0 : 1], out_Pa = axis.load_Pa[extend ? 1 : 0];
  const double drive_N = std::max((supply_Pa - in_Pa) * in_m2 + out_Pa * out_m2, kLeastDrop_Pa * (in_m2 + out_m2));
  return axis.valve_gain * std::sqrt(drive_N / (in_m2 * in_m2 * in_m2 + out_m2 * out_m2 * out_m2)) / axis.lever_m;
}

/// Its speed by the valve's data, and what that lacks by the speed seen.
double OwnController::spool_for(Axis& axis, int joint, double share) noexcept {
  const std::size_t way = share > 0 ? 1 : 0;
  const double full_radps = full_rate_radps_[way][joint], wanted_radps = share * full_radps;
  if (std::abs(wanted_radps) < kSlowest_radps) {
    axis.sum = 0;
    return 0;
  }
  if (way != std::exchange(axis.way, way)) axis.sum = 0;  // else who pressed for long would not come away
  const double error = (wanted_radps - axis.rate_radps) / full_radps, direction = share > 0 ? 1 : -1;
  axis.sum = std::clamp(axis.sum + kIntegral * to_seconds(kPeriod) * error, -1.0, 1.0);
  const double open = wanted_radps / full_opening_radps(axis, share > 0) + axis.sum;
  // A load that runs ahead is throttled, not driven back.
  const double opening = axis.valve.opening_for(std::max(0.0, direction * open), share > 0);
  const double dead_band = axis.valve.dead_band(share > 0);
  return direction * (dead_band + (1 - dead_band) * opening);
}

void OwnController::step(Time now, const Seen& sensors, bool supplied) noexcept {
  const bool hears = fresh(now) && !estop_;
  pilot_ = hears && led();
  if (!pilot_) {
    spool_demand_.setZero();
    for (Axis& axis : axes_) axis.sum = 0;
  }
  control(now, sensors);
  stage_.step(spool_demand_, pilot_ && supplied, stepped_at_ == kNever ? 0 : to_seconds(now - stepped_at_));
  stepped_at_ = now;
}

void OwnController::control(Time now, const Seen& sensors) noexcept {
  if (controlled_at_ != kNever && now - controlled_at_ < kPeriod) return;
  const double passed_s = controlled_at_ == kNever ? 0 : to_seconds(now - controlled_at_);
  controlled_at_ = now;
  for (int joint = 0; joint < kJoints; ++joint) {
    Axis& axis = axes_[static_cast<std::size_t>(joint)];
    const auto head = static_cast<std::size_t>(2 * joint);
    if (passed_s > 0) {
      const double seen = std::abs(sensors.joint_rad[joint] - axis.last_rad) / passed_s;
      const double share = 1 - std::exp(-passed_s / kRateFilter_s);
      axis.rate_radps += share * (std::copysign(seen, sensors.cylinder_mps[joint]) - axis.rate_radps);
    }
    const double share_of_load = 1 - std::exp(-passed_s / kLoadFilter_s);
    for (const std::size_t side : {0UL, 1UL}) {
      const double now_Pa = sensors.pressure_Pa[head + side];
      axis.load_Pa[side] += (passed_s > 0 ? share_of_load : 1) * (now_Pa - axis.load_Pa[side]);
    }
    axis.last_rad = sensors.joint_rad[joint];
    axis.lever_m = std::max(kLeastLever_m, std::abs(sensors.lever_m[joint]));
    if (!pilot_) continue;
    const double share = asked(joint);
    spool_demand_[joint] = kind_ == CommandKind::kJointRate ? spool_for(axis, joint, share) : share;
  }
}

}  // namespace knuckle::sim
