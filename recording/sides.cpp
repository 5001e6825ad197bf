#include "recording/sides.h"

#include "recording/recorder.h"

namespace knuckle::recording {

OperatorSide::OperatorSide(const OperatorSetup& setup, HidPort& port, Link& wire)
    : device(port, tap),
      link(wire, tap),
      master(setup.device, setup.machine, device, link, setup.start, setup.law, setup.far_end) {
  master.set_assist(setup.assist);
}

void OperatorSide::record_to(Recorder& recorder) {
  tap.record_to(recorder.operator_steps());
}

void OperatorSide::step(Time now) noexcept {
  master.step(now);
  end_step(tap, now, master);
}

MachineSide::MachineSide(const MachineDescription& machine, CanBus& bus, Link& wire, const LinkStart& start)
    : can(bus, tap), link(wire, tap), slave(machine, can, link, start) {}

void MachineSide::record_to(Recorder& recorder) {
  tap.record_to(recorder.machine_steps());
}

void MachineSide::report_status(const MachineDescription& machine, bool simulated, Mailbox<LoopHealth>* health) {
  reporter.emplace(machine, can, can.meter(), link, simulated, health);
}

void MachineSide::step(Time now) noexcept {
  can.stamp(now);
  slave.step(now);
  if (reporter) reporter->step(now, slave);
  end_step(tap, now, slave);
}

}  // namespace knuckle::recording
