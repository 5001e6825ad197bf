// What a line of text says; a failed assertion shows the line.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace knuckle::test {

[[nodiscard]] inline testing::AssertionResult says(const std::string& line, const std::string& part) {
  return testing::AssertionResult(line.find(part) != std::string::npos) << '"' << part << "\" in \"" << line << '"';
}

[[nodiscard]] inline testing::AssertionResult begins(const std::string& line, const std::string& part) {
  return testing::AssertionResult(line.starts_with(part)) << '"' << part << "\" first in \"" << line << '"';
}

}  // namespace knuckle::test
