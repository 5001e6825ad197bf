// `knuckle identify` from outside, in a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

class IdentifyFolder : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return folder_.file(name); }
  static ProgramRun identify(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "identify");
    return run_program(program("knuckle"), std::move(arguments));
  }
  [[nodiscard]] nlohmann::json json(const std::string& name) const {
    return nlohmann::json::parse(std::ifstream(path(name)));
  }

  TemporaryFolder folder_;
};

}  // namespace knuckle::test
