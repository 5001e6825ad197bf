// The machine's description by name, for headers that only hand it on: a change of it rebuilds what looks into it.
#pragma once

namespace knuckle {

struct MachineDescription;

}  // namespace knuckle
