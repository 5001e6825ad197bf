#include "app/session/session_sides.h"

namespace knuckle::session {

MachineSide::MachineSide(const MachineDescription& description, const sim::MachineTruth& truth,
                         const Scenario& scenario, std::uint64_t seed, Link& link)
    : slave_period(sim::period_in_ticks(description)),
      simulated(truth, scenario.world, scenario.start_rad, seed),
      can(simulated.controllers_end(), description.bus.bit_rate),
      tapped_link(link, tap),
      slave(description, tapped_can, tapped_link, start_from(seed, LinkEnd::kMachine)) {}

}  // namespace knuckle::session
