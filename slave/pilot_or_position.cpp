#include "slave/pilot_or_position.h"

#include "machine/pilot_spool.h"
#include "machine/reason_text.h"
#include "slave/pilot_monitor.h"

namespace knuckle::slave {
namespace {

/// So long after the last demand a pressure has fallen: PilotMonitor's window, and what a slow valve takes to shut
/// (delay and full stroke). No longer, for the cylinder stops then, and behind a reading that stayed open a centimetre
/// of oil, which is a fault, takes as little as 30 ms. An angle that freezes as the operator lets go is found sooner:
/// by the oil that the falling pressure still lets through.
constexpr double kFalls_s = ValveMonitor::kWindow_s;

}  // namespace

PilotOrPosition::PilotOrPosition(const MachineDescription& machine, double step_s) : step_s_(step_s) {
  const bool by_rate = machine.bus.command_kind == CommandKind::kJointRate;
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    Axis& axis = axes_[joint];
    axis.position = subject_of(NodeRole::kEncoder, i, machine.bus);
    axis.told = tells_pilots(machine.bus, i);
    for (const bool extend : {false, true}) {
      if (!axis.told) break;
      const BroadcastField& field = *machine.bus.broadcast(NodeRole::kPilot, 2 * i + (extend ? 0 : 1)).field;
      axis.lines[extend ? 1 : 0] = {
          .subject = signal_subject(field.signal),
          .shut_Pa = field.shut_Pa,
          .least_asked = by_rate ? kPilotLimits.asked : machine.cylinders[joint].valve.dead_band(extend)};
    }
  }
}

void PilotOrPosition::step(const Piloting& piloting) noexcept {
  for (int i = 0; i < kJoints; ++i) {
    for (const bool extend : {false, true}) {
      Line& line = axes_[static_cast<std::size_t>(i)].lines[extend ? 1 : 0];
      line.pressure_Pa = piloting.pressure_Pa[static_cast<std::size_t>(2 * i + (extend ? 0 : 1))];
      const bool asked = (extend ? 1 : -1) * piloting.demand[i] >= line.least_asked;
      line.unasked_s = asked ? 0 : line.unasked_s + step_s_;
    }
  }
}

std::uint8_t PilotOrPosition::of_open(int joint, int direction) const noexcept {
  const Axis& axis = axes_[static_cast<std::size_t>(joint)];
  const Line& opens = axis.lines[direction > 0 ? 1 : 0];
  return axis.told && opens.unasked_s > kFalls_s ? opens.subject : axis.position;
}

std::uint8_t PilotOrPosition::of_shut(int joint, int direction) const noexcept {
  const Axis& axis = axes_[static_cast<std::size_t>(joint)];
  const Line &opens = axis.lines[direction > 0 ? 1 : 0], &other = axis.lines[direction > 0 ? 0 : 1];
  if (!axis.told || opens.unasked_s > kPilotLimits.lag_s) return axis.position;
  // It opens by what its pressure is above the other one.
  return opens.pressure_Pa < opens.shut_Pa ? opens.subject : other.subject;
}

}  // namespace knuckle::slave
