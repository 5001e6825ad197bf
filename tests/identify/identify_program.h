// `knuckle identify` in this process, in a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/command.h"
#include "app/identify/identify.h"
#include "tests/support/refusal.h"
#include "tests/support/run_inside.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

class IdentifyFolder : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  static ProgramRun identify(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "identify");
    return run_inside(program_of_it(), arguments);
  }
  /// What it refuses to do so; "accepted" where it does not.
  static std::string refusal(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "identify");
    return test::refusal([&] { (void)cli::parse_command_line(program_of_it(), arguments).run(); });
  }
  [[nodiscard]] nlohmann::json json(const std::string& name) const {
    return nlohmann::json::parse(std::ifstream(path(name)));
  }

  TemporaryFolder folder_;

 private:
  static cli::Program program_of_it() {
    return {"knuckle", "", "", {identify::identify_entry(identify::identify_command)}};
  }
};

}  // namespace knuckle::test
