// The documented machine of the 1.5 t class, read once.
#pragma once

#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::test {

inline const MachineDescription& solar() {
  static const MachineDescription machine = load_machine(source_dir() + "/config/machines/solar015.toml");
  return machine;
}

}  // namespace knuckle::test
