// `knuckle bus` as a person calls it, within the test's own process.
#pragma once

#include <string>
#include <vector>

#include "app/eds/bus_command.h"
#include "tests/support/run_inside.h"

namespace knuckle::test {

inline ProgramRun run_bus(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "bus");
  return run_inside({"knuckle", "", "", {eds::bus_entry()}}, arguments);
}

}  // namespace knuckle::test
