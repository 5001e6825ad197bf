#include "slave/plausibility.h"

#include <algorithm>
#include <cmath>

namespace knuckle::slave {
namespace {

constexpr PlausibilityLimits kLimits = kPlausibility;

std::size_t fed_chamber(int joint, double spool) noexcept {
  return static_cast<std::size_t>(2 * joint + (spool > 0 ? 0 : 1));
}

Reason implausible(std::uint8_t node, double value, double limit) noexcept {
  return {ReasonCode::kSensorImplausible, node, static_cast<float>(value), static_cast<float>(limit)};
}

}  // namespace

Plausibility::Plausibility(const MachineDescription& machine, double step_s)
    : machine_(machine),
      step_s_(step_s),
      repeats_(machine.sensors.pressure_noise_Pa >= 0.5 * machine.sensors.pressure_step_Pa ? kLimits.repeats
                                                                                           : kLimits.repeats_quiet) {}

void Plausibility::reset() noexcept {
  started_ = false;
  axes_ = {};
  chambers_ = {};
}

double Plausibility::dead_band(int joint, double spool) const noexcept {
  const ValveDescription& valve = machine_.cylinders[static_cast<std::size_t>(joint)].valve;
  return spool > 0 ? valve.dead_band_extend : valve.dead_band_retract;
}

/// Flow that surely reaches the cylinder [m3/s]; 0 where another axis may take it all.
double Plausibility::sure_flow(int joint, const estimation::Measurement& m, const JointVector& spool) const noexcept {
  JointVector flow = JointVector::Zero();
  double lightest_Pa = 1e12;
  for (int i = 0; i < kJoints; ++i) {
    const double band = dead_band(i, spool[i]);
    if (std::abs(spool[i]) <= band) continue;
    const ValveDescription& valve = machine_.cylinders[static_cast<std::size_t>(i)].valve;
    const double share = machine_.hydraulics.load_sensing_margin_Pa / valve.nominal_drop_Pa;
    flow[i] = (std::abs(spool[i]) - band) / (1 - band) * valve.nominal_flow_m3ps * std::sqrt(share);
    lightest_Pa = std::min(lightest_Pa, m.pressure_Pa[fed_chamber(i, spool[i])]);
  }
  const double available = kLimits.pump_reserve * machine_.hydraulics.pump_flow_m3ps;
  if (flow.sum() <= available) return kLimits.sure_flow * flow[joint];
  if (m.pressure_Pa[fed_chamber(joint, spool[joint])] > lightest_Pa) return 0;
  return kLimits.sure_flow * flow[joint] * available / flow.sum();
}

/// Travel that goes into the oil when the fed chamber's pressure rises: dV = V dp / beta.
double Plausibility::compressed_m(int joint, int direction, double length_m, double rise_Pa) const noexcept {
  const CylinderDescription& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
  const double area = direction > 0 ? cylinder.head_area_m2() : cylinder.rod_side_area_m2();
  const double filled = direction > 0 ? length_m - cylinder.min_length_m : cylinder.max_length_m - length_m;
  const double volume = machine_.hydraulics.hose_volume_m3 + area * std::max(0.0, filled);
  return std::max(0.0, rise_Pa) * volume / (machine_.hydraulics.bulk_modulus_Pa * area);
}

Reason Plausibility::frozen(int joint, const estimation::Measurement& m, const JointVector& spool) noexcept {
  Axis& axis = axes_[static_cast<std::size_t>(joint)];
  const CylinderDescription& cylinder = machine_.cylinders[static_cast<std::size_t>(joint)];
  const double length = m.cylinder_m[joint], pressure = m.pressure_Pa[fed_chamber(joint, spool[joint])];
  const bool open = std::abs(spool[joint]) > dead_band(joint, spool[joint]) + kLimits.open_margin;
  const int direction = open ? (spool[joint] > 0 ? 1 : -1) : 0;
  axis.open_s = direction != 0 && direction == axis.direction ? axis.open_s + step_s_ : 0;
  const bool pump_up = axis.open_s >= kLimits.pump_lags * machine_.hydraulics.load_sensing_lag_s;
  const bool at_end =
      direction > 0 ? length > cylinder.max_length_m - kLimits.end_m : length < cylinder.min_length_m + kLimits.end_m;
  const bool stalled = pressure > kLimits.stalled * machine_.hydraulics.main_relief_Pa;
  if (!pump_up || direction != axis.direction || direction == 0 || stalled || at_end ||
      std::abs(length - axis.anchor_m) >= kLimits.moved_m) {
    axis.direction = direction;
    axis.anchor_m = length;
    axis.fed_Pa = pressure;
    axis.delivered_m = 0;
    return {};
  }
  const double area = direction > 0 ? cylinder.head_area_m2() : cylinder.rod_side_area_m2();
  axis.delivered_m += sure_flow(joint, m, spool) / area * step_s_;
  const double unseen = axis.delivered_m - compressed_m(joint, direction, length, pressure - axis.fed_Pa);
  if (unseen <= kLimits.unseen_m) return {};
  return implausible(machine_.bus.encoders[static_cast<std::size_t>(joint)].id, unseen, kLimits.unseen_m);
}

Reason Plausibility::moving_while_closed(int joint, const estimation::Measurement& m, double spool) noexcept {
  Axis& axis = axes_[static_cast<std::size_t>(joint)];
  const double step = m.cylinder_m[joint] - axis.last_m;
  axis.last_m = m.cylinder_m[joint];
  const bool closed = std::abs(spool) < dead_band(joint, spool) - kLimits.closed_margin;
  const auto head = static_cast<std::size_t>(2 * joint);
  const bool relieving =
      std::max(m.pressure_Pa[head], m.pressure_Pa[head + 1]) > kLimits.relief * machine_.hydraulics.port_relief_Pa;
  axis.closed_s = closed && !relieving ? axis.closed_s + step_s_ : 0;
  if (axis.closed_s < kLimits.settle_s) {
    axis.travel_m = 0;
    return {};
  }
  axis.travel_m += step - axis.travel_m * step_s_ / kLimits.closed_forget_s;
  if (std::abs(axis.travel_m) <= kLimits.closed_travel_m) return {};
  return implausible(machine_.bus.encoders[static_cast<std::size_t>(joint)].id, std::abs(axis.travel_m),
                     kLimits.closed_travel_m);
}

Reason Plausibility::stuck(std::size_t chamber, const estimation::Measurement& m) noexcept {
  Chamber& seen = chambers_[chamber];
  const double value = m.pressure_Pa[chamber], other = m.pressure_Pa[chamber ^ 1U];
  const double length = m.cylinder_m[static_cast<int>(chamber / 2)];
  if (value != seen.value_Pa || value < kLimits.cavitating_Pa) {
    seen = {value, 0, other, other, length};
    return {};
  }
  ++seen.repeats;
  seen.other_min_Pa = std::min(seen.other_min_Pa, other);
  seen.other_max_Pa = std::max(seen.other_max_Pa, other);
  const bool others_live = seen.other_max_Pa - seen.other_min_Pa > kLimits.other_side_Pa ||
                           std::abs(length - seen.length_m) > kLimits.repeat_travel_m;
  if (seen.repeats < repeats_ || !others_live) return {};
  return implausible(machine_.bus.pressures[chamber].id, seen.repeats, repeats_);
}

Reason Plausibility::step(const estimation::Measurement& measurement, const JointVector& spool) noexcept {
  if (!started_) {
    for (int i = 0; i < kJoints; ++i) axes_[static_cast<std::size_t>(i)].last_m = measurement.cylinder_m[i];
    started_ = true;
  }
  Reason first;
  const auto note = [&first](const Reason& reason) {
    if (!first) first = reason;
  };
  for (int i = 0; i < kJoints; ++i) {
    note(frozen(i, measurement, spool));
    note(moving_while_closed(i, measurement, spool[i]));
  }
  for (std::size_t i = 0; i < chambers_.size(); ++i) note(stuck(i, measurement));
  return first;
}

}  // namespace knuckle::slave
