// The two simulated sides of a session on virtual time, each behind its wire: what lies between them (master loop,
// link, what goes wrong) belongs to whoever runs the session.
#pragma once

#include <cstdint>

#include "app/session/scenario.h"
#include "core/loop_table.h"
#include "core/time.h"
#include "machine/description.h"
#include "recording/sides.h"
#include "sim/haptic_device.h"
#include "sim/machine_on_bus.h"
#include "sim/person.h"
#include "sim/truth.h"
#include "transport/hid_pair.h"
#include "transport/link.h"

namespace knuckle::session {

/// A limb on a haptic device at the end of its cable.
struct HandSide {
  HandSide(const sim::DeviceTruth& built, const sim::LimbImpedance& limb, std::uint64_t seed,
           const JointVector& start_rad)
      : device(built, limb, cable.device(), seed, start_rad) {}

  /// One tick; the master's step comes next.
  void step(Time now, const sim::OperatorIntent& intent) noexcept {
    cable.advance();
    device.step(now, intent);
  }

  HidPair cable;
  sim::HandAndDevice device;
};

/// A machine in its world, its bus and the side that leads it.
struct SimulatedMachineSide {
  /// @param link outlives this. @throws InputError where machine file, truth, world and start do not fit together.
  SimulatedMachineSide(const MachineDescription& description, const sim::MachineTruth& truth, const Scenario& scenario,
                       std::uint64_t seed, Link& link)
      : slave_period(sim::period_in_ticks(description)),
        simulated(truth, scenario.world, scenario.start_rad, seed),
        side(description, simulated.controllers_end(), link, start_from(seed, LinkEnd::kMachine)) {}

  /// One tick. @param controller called where the slave's step is due, which is its to take or to leave out.
  template <typename Controller>
  void step(Time now, const Controller& controller) noexcept {
    simulated.step(now, [&] {
      if (now.time_since_epoch() % slave_period == Duration::zero()) controller();
    });
  }

  Duration slave_period;
  sim::MachineOnBus simulated;
  recording::MachineSide side;
};

}  // namespace knuckle::session
