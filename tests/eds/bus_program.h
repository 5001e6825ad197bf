// `knuckle bus` as a person calls it, within the test's own process.
#pragma once

#include <gtest/gtest.h>

#include <iostream>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/eds/bus_command.h"
#include "tests/support/run_program.h"

namespace knuckle::test {

inline ProgramRun run_bus(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "bus");
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  ProgramRun run;
  run.exit_code = cli::run_program({"knuckle", "", "", {eds::bus_entry()}}, arguments);
  std::cout << std::flush;
  run.out = testing::internal::GetCapturedStdout();
  run.err = testing::internal::GetCapturedStderr();
  return run;
}

}  // namespace knuckle::test
