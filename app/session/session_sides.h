// The two simulated sides of a session on virtual time, each behind its wire: what lies between them (master loop,
// link, what goes wrong) belongs to whoever runs the session.
#pragma once

#include <cstddef>
#include <cstdint>

#include "app/session/scenario.h"
#include "core/time.h"
#include "machine/description.h"
#include "sim/haptic_device.h"
#include "sim/operator_limb.h"
#include "sim/simulated_machine.h"
#include "sim/truth.h"
#include "slave/slave_loop.h"
#include "transport/faulty_ports.h"
#include "transport/hid_pair.h"
#include "transport/link.h"
#include "transport/virtual_can.h"
#include "transport/watched_can.h"

namespace knuckle::session {

inline constexpr Duration kTick = 1ms;  ///< Of every session on virtual time.

/// A limb on a haptic device at the end of its cable.
struct HandSide {
  HandSide(const DeviceDescription& description, const sim::LimbImpedance& limb, std::uint64_t seed,
           const JointVector& start_rad)
      : device(description, limb, device_end, seed, start_rad) {}

  /// One tick; the master's step comes next.
  void step(Time now, const sim::OperatorIntent& intent) noexcept {
    cable.advance();
    device.step(now, intent);
  }

  HidPair cable;
  TruncatingPort device_end{cable.device()};
  sim::HandAndDevice device;
};

/// A machine in its world, its bus and the loop that leads it. One tick is bus.advance(), slave.step() where it is due,
/// machine.step(), in this order.
struct MachineSide {
  static constexpr std::size_t kControllerPort = 0, kMachinePort = 1, kPorts = 2;  ///< Of the bus.
  /// @param link outlives this. @throws InputError where machine file, truth, world and start do not fit together.
  MachineSide(const MachineDescription& description, const sim::MachineTruth& truth, const Scenario& scenario,
              std::uint64_t seed, Link& link);

  [[nodiscard]] bool slave_due(Time now) const noexcept {
    return now.time_since_epoch() % slave_period == Duration::zero();
  }

  Duration slave_period;
  VirtualCanBus bus;
  FaultyPort nodes_end;
  WatchedCan can;  ///< The slave's end of it.
  slave::SlaveLoop slave;
  sim::SimulatedMachine machine;
};

}  // namespace knuckle::session
