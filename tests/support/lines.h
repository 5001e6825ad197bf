// Lines as one text.
#pragma once

#include <string>
#include <vector>

namespace knuckle::test {

/// Each with its end.
[[nodiscard]] inline std::string lines_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace knuckle::test
