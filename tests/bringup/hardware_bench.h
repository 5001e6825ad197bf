// The simulated machine behind a bus, for what looks at buses and moves machines.
#pragma once

#include <memory>

#include "app/identify/commission.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "sim/machine_on_bus.h"
#include "sim/truth.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"

namespace knuckle::bringup::test {

using knuckle::test::solar;

/// Switched on some time ago. @param machine as it really is; the file may say something else.
inline std::shared_ptr<sim::MachineOnBus> simulated_bus(const MachineDescription& machine = solar(),
                                                        std::uint64_t seed = 1) {
  auto made = std::make_shared<sim::MachineOnBus>(sim::sample_truth(machine, seed), sim::WorldDescription{},
                                                  middle_of_range(machine), seed);
  made->advance(Time{50ms});
  CanFrame boot_up;
  while (made->controllers_end().receive(boot_up)) {
  }
  return made;
}

/// Just switched on, as its file says, in a pose that tests know.
inline std::shared_ptr<sim::MachineOnBus> nominal_bus(const MachineDescription& machine) {
  return std::make_shared<sim::MachineOnBus>(sim::nominal_truth(machine), sim::WorldDescription{},
                                             JointVector(0.3, -1.5, -0.8), 1);
}

}  // namespace knuckle::bringup::test
