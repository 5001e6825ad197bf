// Whether a text has a part: EXPECT_TRUE(says(run.err, "--can")) shows both where it has not.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace knuckle {

inline testing::AssertionResult says(const std::string& text, const std::string& part) {
  const bool has_it = text.find(part) != std::string::npos;
  return (has_it ? testing::AssertionSuccess() : testing::AssertionFailure()) << "\"" << part << "\" in: " << text;
}

}  // namespace knuckle
