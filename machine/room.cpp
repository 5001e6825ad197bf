#include "machine/room.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "machine/pilot_spool.h"
#include "machine/signal_units.h"
#include "machine/toml_reader.h"

namespace knuckle {
namespace {

double angle_at(const LinkDescription& link, int step, int steps) {
  return link.min_rad + (link.max_rad - link.min_rad) * step / steps;
}

/// What a machine that is told by frames of its own bus does not say, and what must be there instead.
void add_unknowns(const BusDescription& bus, std::vector<std::string>& notes) {
  if (!bus.by_frames()) return;
  if (!bus.has_enable() && bus.broadcast(NodeRole::kEnable, kEStopClosedIndex).field == nullptr)
    notes.emplace_back(
        "no frame has e_stop_closed: Knuckle does not know whether the machine's E-stop is open, which must stop the "
        "machine by wire");
  if (!bus.has_enable() && bus.broadcast(NodeRole::kEnable, kPilotOnIndex).field == nullptr)
    notes.emplace_back(
        "no frame has pilot_on: Knuckle does not know whether the machine can move, and takes it that it can");
  std::vector<const char*> untold;
  for (int joint = 0; joint < kJoints; ++joint)
    if (!tells_pilots(bus, joint)) untold.push_back(kJointNames[static_cast<std::size_t>(joint)]);
  const std::string spools =
      untold.size() == kJoints ? "the spools are" : "the spool is of " + fmt::format("{}", fmt::join(untold, ", "));
  if (!untold.empty())
    notes.push_back("nobody tells where " + spools +
                    ": a valve that does not follow, or a position sensor that stands still, is found by the joint's "
                    "motion alone, after about a second");
  for (const NodeDescription& node : bus.nodes) {
    const bool sure = node.guard.proved && node.guard.changed == GuardProof::Changed::kNothing;
    if (!sure && moves_joints(bus, node.id))
      notes.push_back("that the outputs of " + node.name +
                      " take their error values when their controller falls silent is not proved: knuckle commission "
                      "proves it");
  }
  if (!moves_joints(bus, kOwnController)) return;
  const std::string ends =
      fmt::format("that the machine's own controller ends all motion {} ms after the last command frame ",
                  number_text(1e3 * bus.valve_watchdog_s));
  const GuardProof& proof = bus.commands_guard;
  if (proof.proved && proof.changed == GuardProof::Changed::kNothing) return;
  if (proof.date.empty())
    notes.push_back(ends + "is not proved: knuckle commission proves it");
  else if (!proof.proved)
    notes.push_back(ends + "was tried on " + proof.date + " and not proved");
  else
    notes.push_back(ends + "was proved on " + proof.date +
                    ", with other frames or another valve_watchdog_ms than the machine file now has");
}

void add_untold_wires(const BusDescription& bus, std::vector<std::string>& notes) {
  for (const BroadcastFrame& frame : bus.broadcasts) {
    for (const BroadcastField& field : frame.fields) {
      if (!field.analog || field.analog->range != AnalogSensor::Range::k0To10V) continue;
      notes.push_back(fmt::format(
          "{} is on a 0-10V input, where a broken wire reads as 0 V, as {}: what else tells that it is wrong "
          "must be known, or use 4-20mA or 0.5-4.5V",
          field.info().name, value_text(field.info(), field.analog->low)));
    }
  }
}

}  // namespace

std::vector<PlanarVector> tips_over_range(const MachineDescription& machine) {
  constexpr int kSteps = 12;
  const auto angle = [&](std::size_t joint, int step) { return angle_at(machine.links[joint], step, kSteps); };
  std::vector<PlanarVector> tips_m;
  for (int boom = 0; boom <= kSteps; ++boom) {
    for (int arm = 0; arm <= kSteps; ++arm) {
      for (int bucket = 0; bucket <= kSteps; ++bucket)
        tips_m.push_back(pose_of(machine, {angle(kBoom, boom), angle(kArm, arm), angle(kBucket, bucket)}).tip_m);
    }
  }
  return tips_m;
}

LeverRange lever_range(const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  constexpr int kSteps = 200;
  LeverRange range{1e9, 0};
  for (int step = 0; step <= kSteps; ++step) {
    const double angle = angle_at(machine.links[static_cast<std::size_t>(joint)], step, kSteps);
    const double lever_m = std::abs(kinematics.cylinder_at(joint, angle)->lever_m);
    range = {std::min(range.shortest_m, lever_m), std::max(range.longest_m, lever_m)};
  }
  return range;
}

JointSpan cylinder_span(const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  constexpr double kStep_rad = 1e-3;
  const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
  return {kinematics.outermost(machine, joint, link.min_rad, -kStep_rad, 0),
          kinematics.outermost(machine, joint, link.max_rad, kStep_rad, 0)};
}

double fastest_rate_radps(const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  return machine.hydraulics.pump_flow_m3ps / (machine.cylinders[static_cast<std::size_t>(joint)].head_area_m2() *
                                              lever_range(machine, kinematics, joint).longest_m);
}

std::vector<WallRoom> wall_rooms(const MachineDescription& machine) {
  const std::vector<PlanarVector> tips_m = tips_over_range(machine);
  /// @param side -1 where the tip must stay above the limit.
  const auto room = [&](const char* key, int axis, double side, double limit_m) {
    double furthest_m = -1e9;
    std::size_t beyond = 0;
    for (const PlanarVector& tip_m : tips_m) {
      furthest_m = std::max(furthest_m, side * tip_m[axis]);
      beyond += side * (tip_m[axis] - limit_m) > 0 ? 1U : 0U;
    }
    return WallRoom{key, limit_m, side * furthest_m, static_cast<double>(beyond) / static_cast<double>(tips_m.size())};
  };
  return {room("floor_m", 1, -1, machine.limits.floor_m), room("ceiling_m", 1, 1, machine.limits.ceiling_m),
          room("reach_m", 0, 1, machine.limits.reach_m)};
}

std::vector<std::string> machine_notes(const MachineDescription& machine) {
  constexpr double kWorthTelling = 0.01;
  std::vector<std::string> notes;
  for (const WallRoom& room : wall_rooms(machine)) {
    if (room.cut_share < kWorthTelling) continue;
    notes.push_back(
        fmt::format("limits.{} = {} of machine '{}' cuts off {:.0f} % of the working range: without it the tip goes to "
                    "{:.2f} m. The machine stops there without a fault; is the limit another machine's?",
                    room.key, number_text(room.limit_m), machine.name, 100 * room.cut_share, room.reached_m));
  }
  if (const int without = machine.sensors.without_pressures; without != SensorDescription::kNone)
    notes.push_back(fmt::format(
        "sensors.without_pressures = {}: forces rest on the two other cylinders. Where on the bucket one acts is not "
        "seen, and in a direction that they do not tell it may not be noticed at all: in a contact the tip does not go "
        "on that way. Relief valves alone bound this cylinder's pressure, and a frozen encoder of it is found after "
        "some centimetres instead of millimetres",
        kJointNames[static_cast<std::size_t>(without)]));
  add_unknowns(machine.bus, notes);
  add_untold_wires(machine.bus, notes);
  return notes;
}

}  // namespace knuckle
