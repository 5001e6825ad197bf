// A command that runs within the test's own process: its exit code and what it prints.
#pragma once

#include <gtest/gtest.h>

#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "tests/support/run_program.h"

namespace knuckle::test {

/// @param act gives the exit code. What it throws comes out of here, when nothing is captured any more.
template <typename Act>
ProgramRun run_inside(const Act& act) {
  std::cout << std::flush;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  ProgramRun run;
  std::exception_ptr thrown;
  try {
    run.exit_code = act();
  } catch (...) {
    thrown = std::current_exception();
  }
  std::cout << std::flush;
  run.out = testing::internal::GetCapturedStdout();
  run.err = testing::internal::GetCapturedStderr();
  if (thrown) std::rethrow_exception(thrown);
  return run;
}

/// As a shell would run it. @param arguments without the program's name.
inline ProgramRun run_inside(const cli::Program& program, const std::vector<std::string>& arguments) {
  return run_inside([&] { return cli::run_program(program, arguments); });
}

}  // namespace knuckle::test
