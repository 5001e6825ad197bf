// What is looked at before anything of a machine is configured or moved.
#pragma once

#include <functional>

#include "app/bringup/commission_dialogue.h"
#include "app/bringup/doctor_bus.h"
#include "machine/description_fwd.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

/// Reads only, and says what it finds. @throws CommissionEnded where another controller is heard, or a bus has
/// faults.
BusDiagnosis sound_bus(const MachineDescription& machine, BusAccess& access, Dialogue& dialogue,
                       const std::function<void()>& check);
/// Right before the first frame that commands: a person may have taken minutes to say yes. @throws CommissionEnded
/// where another controller is heard.
void alone_on_bus(const MachineDescription& machine, BusAccess& access);

}  // namespace knuckle::bringup
