#include "slave/plausibility.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "machine/encoder_length.h"
#include "machine/pilot_spool.h"
#include "machine/reason_text.h"

namespace knuckle::slave {

Plausibility::Plausibility(const MachineDescription& machine, double step_s)
    : cylinders_(machine.cylinders),
      hydraulics_(machine.hydraulics),
      bus_(machine.bus),
      wrong_(machine, step_s),
      step_s_(step_s),
      step_Pa_(machine.sensors.pressure_step_Pa),
      moved_m_((kPlausibility.moved_steps * length_steps_m(machine)).cwiseMax(kPlausibility.moved_m)) {
  const bool noisy = machine.sensors.pressure_noise_Pa >= 0.5 * step_Pa_, coarse = step_Pa_ > kPlausibility.coarse_Pa;
  const int samples = noisy    ? kPlausibility.repeats
                      : coarse ? kPlausibility.repeats_coarse
                               : kPlausibility.repeats_quiet;
  for (std::size_t chamber = 0; chamber < repeats_.size(); ++chamber) {
    const BroadcastFrame* const frame = bus_.broadcast(NodeRole::kPressure, static_cast<int>(chamber)).frame;
    const double steps_held = frame == nullptr ? 1 : std::max(1.0, std::ceil(frame->period_s / step_s_));
    repeats_[chamber] = static_cast<int>(steps_held) * samples;
  }
  for (std::size_t i = 0; i < kJoints; ++i) {
    const std::optional<ValveCalibration>& found = machine.valve_calibration[i];
    const bool sure = found && found->straight();
    axes_[i].share.fill(FlowShare(sure));
    told_[i] = bus_.command_kind == CommandKind::kSpool || tells_pilots(bus_, static_cast<int>(i));
  }
}

void Plausibility::reset() noexcept {
  for (Axis& axis : axes_) {
    for (FlowShare& share : axis.share) share.drop();
    axis = Axis{.share = axis.share};
  }
  chambers_ = {};
  still_ = {};
}

/// Oil that leaves the cylinder [m3/s]. The return edge is the one to ask: its drop is measured, whatever the pump has
/// to give; and against a wall the returning side falls to tank pressure, so that nothing is expected.
double Plausibility::nominal_flow(int joint, double spool, double return_Pa) const noexcept {
  const ValveDescription& valve = cylinders_[static_cast<std::size_t>(joint)].valve;
  const double drop_Pa = std::max(0.0, return_Pa - hydraulics_.tank_Pa - kPlausibility.sure_drop_Pa);
  return valve.flow_share(valve.opening(spool), spool > 0) * valve.nominal_flow_m3ps *
         std::sqrt(drop_Pa / valve.nominal_drop_Pa);
}

/// Of the side that lets oil out. Of a cylinder without transmitters: as if nothing hung on it and the pump's margin
/// drove its oil through both edges.
double Plausibility::return_Pa(const estimation::Measurement& m, int joint, int direction) const noexcept {
  const auto i = static_cast<std::size_t>(joint);
  if (m.pressures_known[i]) return m.pressure_Pa[2 * i + (direction > 0 ? 1 : 0)];
  const double head = cylinders_[i].head_area_m2(), rod = cylinders_[i].rod_side_area_m2();
  const double out_over_in = direction > 0 ? rod / head : head / rod;
  return hydraulics_.tank_Pa + kPlausibility.sure_drop_Pa +
         hydraulics_.load_sensing_margin_Pa * out_over_in * out_over_in;
}

/// Travel's worth of oil that leaves because the returning side's pressure falls, or, negative, that stays there
/// because it rises: dV = V dp / beta.
double Plausibility::expanded_m(int joint, int direction, double length_m, double fall_Pa) const noexcept {
  const CylinderDescription& cylinder = cylinders_[static_cast<std::size_t>(joint)];
  const double area = direction > 0 ? cylinder.rod_side_area_m2() : cylinder.head_area_m2();
  const double filled = direction > 0 ? cylinder.max_length_m - length_m : length_m - cylinder.min_length_m;
  const double volume = hydraulics_.hose_volume_m3 + area * std::max(0.0, filled);
  return fall_Pa * volume / (hydraulics_.bulk_modulus_Pa * area);
}

Reason Plausibility::frozen(int joint, const estimation::Measurement& m, double spool) noexcept {
  Axis& axis = axes_[static_cast<std::size_t>(joint)];
  const CylinderDescription& cylinder = cylinders_[static_cast<std::size_t>(joint)];
  const double length = m.cylinder_m[joint];
  const bool open = std::abs(spool) > cylinder.valve.dead_band(spool > 0) + kPlausibility.open_margin;
  int direction = open ? (spool > 0 ? 1 : -1) : 0;
  axis.shut_s = open ? 0 : axis.shut_s + step_s_;
  const bool passing = !open && axis.shut_s < kPlausibility.passing_s;
  if (passing) direction = axis.direction;
  const double pressure = return_Pa(m, joint, passing ? direction : spool > 0 ? 1 : -1);
  const bool at_end = direction > 0 ? length > cylinder.max_length_m - kPlausibility.end_m
                                    : length < cylinder.min_length_m + kPlausibility.end_m;
  FlowShare& share = axis.share[direction >= 0 ? 0 : 1];
  const double moved_m = direction * (length - axis.anchor_m);
  if (direction != axis.direction || direction == 0 || at_end || std::abs(moved_m) >= moved_m_[joint]) {
    if (direction == axis.direction && direction != 0 && !at_end && moved_m > 0) {
      const double flowed_m = moved_m + expanded_m(joint, direction, length, axis.return_Pa - pressure);
      share.see(std::max(0.0, flowed_m));
    }
    for (FlowShare& either : axis.share) either.drop();
    axis.direction = direction;
    axis.anchor_m = length;
    axis.return_Pa = pressure;
    axis.delivered_m = axis.stalled_s = 0;
    return {};
  }
  if (passing) return {};
  const double opening = cylinder.valve.opening(spool), expected = share.at(opening);
  // Where the returning side is empty its flow tells nothing. But an axis that stalls behind an open valve is driven up
  // to the relief: one that is not, and is not seen to move, moves unseen.
  const bool measured = m.pressures_known[static_cast<std::size_t>(joint)];
  const double driven = m.pressure_Pa[static_cast<std::size_t>(2 * joint + (direction > 0 ? 0 : 1))];
  const bool stalls = !measured || driven > kPlausibility.stall * hydraulics_.main_relief_Pa;
  axis.stalled_s = stalls ? 0 : axis.stalled_s + expected * step_s_;
  if (axis.stalled_s > kPlausibility.unmoved_s)
    return {ReasonCode::kSensorImplausible, wrong_.of_open(joint, direction), axis.stalled_s, kPlausibility.unmoved_s};
  const double area = direction > 0 ? cylinder.rod_side_area_m2() : cylinder.head_area_m2();
  const double nominal_m = nominal_flow(joint, spool, pressure) / area * step_s_;
  share.pass(opening, nominal_m);
  axis.delivered_m += kPlausibility.sure_flow * expected * nominal_m;
  const double expanded = expanded_m(joint, direction, length, axis.return_Pa - pressure);
  const double unseen = axis.delivered_m - std::max(0.0, expanded);
  const double most = measured && !bus_.by_frames() ? kPlausibility.unseen_m : kPlausibility.unseen_unmeasured_m;
  if (unseen <= most) return {};
  return {ReasonCode::kSensorImplausible, wrong_.of_open(joint, direction), unseen, most};
}

Reason Plausibility::moving_while_closed(int joint, const estimation::Measurement& m, double spool) noexcept {
  Axis& axis = axes_[static_cast<std::size_t>(joint)];
  const double step = m.cylinder_m[joint] - axis.last_m;
  axis.last_m = m.cylinder_m[joint];
  const ValveDescription& valve = cylinders_[static_cast<std::size_t>(joint)].valve;
  const bool closed = std::abs(spool) < valve.dead_band(spool > 0) - kPlausibility.closed_margin;
  const auto head = static_cast<std::size_t>(2 * joint);
  const bool relieving =
      std::max(m.pressure_Pa[head], m.pressure_Pa[head + 1]) > kPlausibility.relief * hydraulics_.port_relief_Pa;
  axis.closed_s = closed && !relieving ? axis.closed_s + step_s_ : 0;
  if (axis.closed_s < kPlausibility.settle_s) {  // also the first step, whose travel is from 0
    axis.travel_m = 0;
    axis.closed_Pa = {m.pressure_Pa[head], m.pressure_Pa[head + 1]};
    return {};
  }
  axis.travel_m += step - axis.travel_m * step_s_ / kPlausibility.closed_forget_s;
  const double length = m.cylinder_m[joint];
  const double gave_m = std::max(std::abs(expanded_m(joint, -1, length, axis.closed_Pa[0] - m.pressure_Pa[head])),
                                 std::abs(expanded_m(joint, 1, length, axis.closed_Pa[1] - m.pressure_Pa[head + 1])));
  const double most_m = kPlausibility.closed_travel_m + kPlausibility.closed_oil * gave_m;
  if (std::abs(axis.travel_m) <= most_m) return {};
  return {ReasonCode::kSensorImplausible, wrong_.of_shut(joint, axis.travel_m > 0 ? 1 : -1), std::abs(axis.travel_m),
          most_m};
}

Reason Plausibility::stuck(std::size_t chamber, const estimation::Measurement& m) noexcept {
  Chamber& seen = chambers_[chamber];
  const double value = m.pressure_Pa[chamber], other = m.pressure_Pa[chamber ^ 1U];
  const double length = m.cylinder_m[static_cast<int>(chamber / 2)];
  const bool coarse = step_Pa_ > kPlausibility.coarse_Pa;
  const double coarse_Pa = coarse ? kPlausibility.coarse_steps * step_Pa_ : 0;
  if (value != seen.value_Pa || value < std::max(kPlausibility.cavitating_Pa, coarse_Pa / 2)) {
    seen = {value, 0, other, other, length};
    return {};
  }
  ++seen.repeats;
  seen.other_min_Pa = std::min(seen.other_min_Pa, other);
  seen.other_max_Pa = std::max(seen.other_max_Pa, other);
  const bool others_live = seen.other_max_Pa - seen.other_min_Pa > std::max(kPlausibility.other_side_Pa, coarse_Pa) ||
                           (!coarse && std::abs(length - seen.length_m) > kPlausibility.repeat_travel_m);
  const int most = repeats_[chamber];
  if (seen.repeats < most || !others_live) return {};
  return {ReasonCode::kSensorImplausible, subject_of(NodeRole::kPressure, static_cast<int>(chamber), bus_),
          double(seen.repeats), double(most)};
}

/// A frame with all pressures that comes again and again, where nothing in it counts.
Reason Plausibility::all_still(const estimation::Measurement& m) noexcept {
  if (m.pressure_Pa != still_.pressure_Pa) {
    still_ = {m.pressure_Pa, m.cylinder_m, 0};
    return {};
  }
  still_.time_s += step_s_;
  const double travel_m = (m.cylinder_m - still_.from_m).cwiseAbs().maxCoeff();
  if (still_.time_s < kPlausibility.still_s || travel_m <= kPlausibility.still_travel_m) return {};
  const auto known = std::find(m.pressures_known.begin(), m.pressures_known.end(), true);
  const auto joint = static_cast<int>(known - m.pressures_known.begin());
  return {ReasonCode::kSensorImplausible, subject_of(NodeRole::kPressure, 2 * joint, bus_), travel_m,
          kPlausibility.still_travel_m};
}

Reason Plausibility::step(const estimation::Measurement& measurement, const JointVector& spool,
                          const Piloting& piloting) noexcept {
  wrong_.step(piloting);
  Reason first;
  const auto note = [&first](const Reason& reason) {
    if (!first) first = reason;
  };
  for (int i = 0; i < kJoints; ++i) {
    const bool told = told_[static_cast<std::size_t>(i)];
    // A commanded speed says nothing of the valve's opening: MotionMonitor looks at the motion.
    if (!told && bus_.command_kind == CommandKind::kJointRate) continue;
    for (Reason why : {frozen(i, measurement, spool[i]), moving_while_closed(i, measurement, spool[i])}) {
      if (why && !told) why = {ReasonCode::kMotionNotFollowing, i, why.value, why.limit};
      note(why);
    }
  }
  for (std::size_t i = 0; i < chambers_.size(); ++i) note(stuck(i, measurement));
  note(all_still(measurement));
  return first;
}

}  // namespace knuckle::slave
