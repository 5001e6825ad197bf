// `knuckle console`: what it refuses before anything opens; and as a program: what it says, and with which code it
// ends.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "app/cli/command.h"
#include "app/console/window/console_program.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::console::window {

struct Ended {
  int code = -1;
  std::string said;
};

/// @param environment such as "DISPLAY= KNUCKLE_FONT_DIR=/nowhere".
inline Ended console_run(const std::string& options, const std::string& environment = {}) {
  const std::string command = "env " + environment + " " + test::program("knuckle") + " console " + options + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  Ended ended;
  std::array<char, 256> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) ended.said += part.data();
  ended.code = WEXITSTATUS(pclose(pipe));
  return ended;
}

inline void expect_refused(const std::string& options, const std::string& because,
                           const std::string& environment = {}) {
  const Ended ended = console_run(options, environment);
  EXPECT_EQ(ended.code, 2) << ended.said;
  EXPECT_EQ(std::count(ended.said.begin(), ended.said.end(), '\n'), 1) << ended.said;
  EXPECT_TRUE(test::says(ended.said, because));
}

struct RefusedOptions {
  std::string options;  ///< Without blanks in any of them.
  std::string because;
};

/// In one line, without a program of its own.
inline void expect_refused_options(const RefusedOptions& row) {
  std::istringstream in("console " + row.options);
  const std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
  const std::string line = test::refusal([&] {
    return cli::parse_command_line({"knuckle", "", "", {console_entry()}}, words).run();
  });
  EXPECT_TRUE(test::says(line, row.because)) << row.options;
  EXPECT_FALSE(test::says(line, "\n")) << row.options;
}

}  // namespace knuckle::console::window
