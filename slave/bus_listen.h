// What whoever is about to command a machine looks at before its first frame: whether somebody else does (two
// controllers would reset each other's nodes for good), and whether this machine may be commanded at all.
#pragma once

#include <string>

#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "transport/bus_access.h"

namespace knuckle::slave {

/// Listens for three periods of heartbeat and SYNC, and sends nothing. What has arrived before counts
/// as well. @return what was heard of that only a controller sends: "SYNC 0x080, heartbeat 0x701"; empty: nothing.
[[nodiscard]] std::string heard_of_other_controller(const BusDescription& bus, BusAccess& access);

/// @throws InputError in one line where there is another controller: heard, and when listened to once more, heard
/// again.
void refuse_other_controller(const BusDescription& bus, BusAccess& access);

/// For a real machine that an operator leads. @throws InputError in one line where a cylinder has no pressure
/// transmitters and the machine is not identified: by a drawing two cylinders tell contacts too badly.
void refuse_unidentified(const MachineDescription& machine);

}  // namespace knuckle::slave
