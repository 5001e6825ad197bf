// Back into the range that the machine file measured: a joint that stands beyond it is refused by every program that
// leads the machine, so it is brought in here, one cylinder, inward alone, slowly, each step after a person's word.
#pragma once

#include <functional>

#include "app/bringup/commission_dialogue.h"
#include "app/cli/command.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

/// Cylinder lengths between which a joint is within its working range [m].
struct LengthRange {
  double shortest_m = 0, longest_m = 0;
};
[[nodiscard]] LengthRange working_lengths(const MachineDescription& machine, int joint);

/// One cylinder into its working range, by motions that jog_gate() judges.
/// @param machine calibrated. @param check called all the time; may throw to end it.
/// @throws CommissionEnded where it did not come to its end; the machine is neutral then.
void recover(const MachineDescription& machine, int joint, BusAccess& access, Partner partner,
             const std::function<void()>& check);

[[nodiscard]] cli::Command recover_entry();

}  // namespace knuckle::bringup
