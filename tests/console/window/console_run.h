// `knuckle console` as a program: what it says, and with which code it ends.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "tests/support/places.h"

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
  EXPECT_NE(ended.said.find(because), std::string::npos) << ended.said;
}

}  // namespace knuckle::console::window
