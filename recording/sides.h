// The two sides of the link as they run everywhere, in sessions, programs, the console and replays: a loop, and beside
// each of its wires the one tap that records and counts what passes.
#pragma once

#include <optional>

#include "core/loop_health.h"
#include "core/mailbox.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/device_description.h"
#include "master/master_loop.h"
#include "recording/loop_tap.h"
#include "recording/tapped_wires.h"
#include "slave/slave_loop.h"
#include "slave/status_reporter.h"
#include "transport/can_bus.h"
#include "transport/hid_port.h"
#include "transport/link.h"
#include "transport/link_session.h"

namespace knuckle::recording {

class Recorder;

struct OperatorSetup {
  DeviceDescription device;
  MachineDescription machine;  ///< As calibrated.
  ControlLaw law = ControlLaw::kEchoSpring;
  LinkStart start;  ///< Drawn anew for each run.
  AssistSettings assist;
  master::FarEnd far_end = master::FarEnd::kTellsItsMachine;
};

struct OperatorSide {
  /// @param port, @param wire outlive this, and are its alone.
  OperatorSide(const OperatorSetup& setup, HidPort& port, Link& wire);
  OperatorSide(const OperatorSide&) = delete;  // its members know each other's addresses
  OperatorSide& operator=(const OperatorSide&) = delete;

  /// Before the first step: all that the loop reads, knows and does goes there. @param recorder outlives the last step.
  void record_to(Recorder& recorder);
  /// A step of the loop, recorded. Allocates nothing.
  void step(Time now) noexcept;

  LoopTap tap;
  TappedHid device;
  TappedLink link;
  master::MasterLoop master;
};

struct MachineSide {
  /// @param bus, @param wire outlive this, and are its alone. @throws InputError where the machine file cannot be
  /// worked with.
  MachineSide(const MachineDescription& machine, CanBus& bus, Link& wire, const LinkStart& start);
  MachineSide(const MachineSide&) = delete;  // likewise
  MachineSide& operator=(const MachineSide&) = delete;

  /// Before the first step: all that the loop reads, knows and does goes there. @param recorder outlives the last step.
  void record_to(Recorder& recorder);
  /// Before the first step: how the machine does is sent beside the loop's own messages. @param machine outlives the
  /// last step. For the other parameters see slave/status_reporter.h.
  void report_status(const MachineDescription& machine, bool simulated, Mailbox<LoopHealth>* health = nullptr);
  /// A step of the loop, recorded. Allocates nothing.
  void step(Time now) noexcept;

  LoopTap tap;
  TappedCan can;
  TappedLink link;
  slave::SlaveLoop slave;
  std::optional<slave::StatusReporter> reporter;
};

}  // namespace knuckle::recording
