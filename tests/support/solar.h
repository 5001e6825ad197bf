// The documented machine of the 1.5 t class, read once.
#pragma once

#include "tests/support/shipped.h"

namespace knuckle::test {

inline const MachineDescription& solar() {
  static const MachineDescription machine = shipped("solar015");
  return machine;
}

}  // namespace knuckle::test
