// `knuckle export` and `knuckle import` as a user runs them, within the test's own program.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "app/export/export_command.h"
#include "app/recordings/import.h"
#include "tests/support/run_inside.h"

namespace knuckle::test {

inline ProgramRun run_knuckle(const std::vector<std::string>& arguments) {
  return run_inside({"knuckle", "", "", {exporting::export_entry(), recordings::import_entry()}}, arguments);
}

inline ProgramRun run_export(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "export");
  return run_knuckle(arguments);
}

inline void expect_refused(const std::vector<std::string>& arguments, const std::string& line) {
  const ProgramRun run = run_export(arguments);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(run.err, "knuckle: " + line + "\n");
}

}  // namespace knuckle::test
