#include "slave/status_reporter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimation/force_estimator.h"
#include "transport/machine_readings.h"

namespace knuckle::slave {
namespace {

MachineStatus::Timing timing(const Histogram& h) noexcept {
  return {h.quantile(0.5), h.quantile(0.99), h.max()};
}

}  // namespace

/// Continuity without compression, Q = A v, and power p Q (Merritt, Hydraulic Control Systems, 1967, ch. 3), with area
/// and pressure of the chamber that is being filled. A cylinder that moves against its spool, or with it inside its
/// dead band (where dither never lets it be 0), is moved by its load or only seems to move: it takes nothing.
OilDemand oil_demand(const MachineDescription& machine, const estimation::JointState& state,
                     const JointVector& spool) noexcept {
  OilDemand demand;
  for (int i = 0; i < kJoints; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const double speed_mps = state.lever_m[i] * state.rate_radps[i];
    const bool extends = speed_mps > 0;
    const CylinderDescription& cylinder = machine.cylinders[joint];
    const ValveDescription& valve = cylinder.valve;
    // A share of speed has no dead band.
    const double shut = machine.bus.command_kind == CommandKind::kJointRate ? 0 : valve.dead_band(extends);
    if (extends ? spool[i] <= shut : spool[i] >= -shut) continue;
    const double area_m2 = extends ? cylinder.head_area_m2() : cylinder.rod_side_area_m2();
    const double flow_m3ps = area_m2 * std::abs(speed_mps);
    demand.flow_m3ps += flow_m3ps;
    demand.power_W += flow_m3ps * std::max(0.0, state.pressure_Pa[2 * joint + (extends ? 0 : 1)]);
  }
  return demand;
}

StatusReporter::StatusReporter(const MachineDescription& machine, const CanBus& bus, CanMeter& meter, Link& link,
                               bool simulated, Mailbox<LoopHealth>* health) noexcept
    : machine_(machine), bus_(bus), meter_(meter), link_(link), mailbox_(health) {
  for (int i = 0; i < static_cast<int>(MachineReadings::kCount); ++i)
    has_readings_ = has_readings_ || machine.bus.broadcast(NodeRole::kReading, i).field != nullptr;
  status_.period = from_seconds(1 / machine.bus.sync_Hz);
  status_.machine = MachineName(machine.name);
  status_.simulated = simulated;
  status_.calibrated = machine.dynamics_calibration.has_value();
}

void StatusReporter::step(Time now, const SlaveLoop& slave) noexcept {
  if (mailbox_ == nullptr) ++status_.steps;
  note_acted(now, slave);
  if (now < due_) return;
  // On a grid, so that the loop's period does not add to this one; what was missed is not made up for.
  due_ = due_ == kNever || now - due_ >= kPeriod ? now + kPeriod : due_ + kPeriod;
  note_health();
  status_.stamp = slave.operator_input().session().stamp(status_.stamp.sequence + 1, now);
  status_.valve_command = slave.commands();
  status_.spool = slave.spool();
  status_.pilot_on = slave.pilot_on();
  const bool fresh = slave.state() && !slave.sensors().fault(now);  // the state outlives its sensors
  const OilDemand oil = fresh ? oil_demand(machine_, *slave.state(), status_.spool) : OilDemand{};
  status_.oil_flow_m3ps = oil.flow_m3ps;
  status_.hydraulic_power_W = oil.power_W;
  const BusDescription& bus = machine_.bus;
  const std::array<double, 2> loads =
      meter_.take_loads(now, bus.bit_rate, bus.second ? bus.second->bit_rate : bus.bit_rate);
  const std::array<CanState, 2> states = bus_.states();
  for (std::size_t i = 0; i < loads.size(); ++i) status_.buses[i] = {loads[i], states[i]};
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  status_.can_errors = static_cast<std::uint32_t>(std::min(bus_.errors(), kMost));
  forget_acted(now, slave);
  status_.acted_ago = status_.acted_report_at == kNever ? Duration::zero() : now - set_points_at_;
  // A force told with no confidence at all rests on no usable sensors, whatever the estimator made of the last ones.
  const bool known = slave.confidence() > 0;
  status_.force_doubts = known ? slave.force().confidence_reasons : std::uint16_t{estimation::kBadInput};
  link_.send(encode(status_).view());
  if (!has_readings_ || status_.stamp.sequence % kEveryNthReadings != 1) return;
  ReadingsMessage message;
  message.stamp = status_.stamp;
  message.stamp.sequence = status_.stamp.sequence / kEveryNthReadings + 1;
  message.set(slave.sensors().readings(now));
  link_.send(encode(message).view());
}

/// A set-point went out in this step: whose hand is behind it?
void StatusReporter::note_acted(Time now, const SlaveLoop& slave) noexcept {
  if (slave.client().set_points_at() != now) return;
  set_points_at_ = now;
  status_.acted_report_at = slave.mode() == Mode::kEngaged ? slave.operator_input().message().device_report_at : kNever;
}

/// Where no set-point can be sent none replaces the last one: after the valves' watchdog nobody's hand is behind it.
void StatusReporter::forget_acted(Time now, const SlaveLoop& slave) noexcept {
  if (slave.mode() == Mode::kEngaged && to_seconds(now - set_points_at_) <= machine_.bus.valve_watchdog_s) return;
  status_.acted_report_at = kNever;
}

void StatusReporter::note_health() noexcept {
  if (mailbox_ == nullptr || !mailbox_->take(health_)) return;
  status_.wake_lateness = timing(health_.wake_lateness);
  status_.execution = timing(health_.execution);
  status_.period = health_.period;
  status_.steps = health_.steps;
  status_.overruns = health_.overruns;
  status_.fifo_priority = health_.fifo_priority;
}

}  // namespace knuckle::slave
