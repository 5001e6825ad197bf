// A text in other words.
#pragma once

#include <stdexcept>
#include <string>

namespace knuckle::test {

/// With `to` in place of the first `from`. @param behind the first of this text, where there is one
/// @throws std::logic_error where there is none: the test does not try what it says.
inline std::string replaced(std::string text, const std::string& from, const std::string& to,
                            const std::string& behind = "") {
  const auto at = text.find(from, text.find(behind));
  if (at == std::string::npos) throw std::logic_error("no such text: " + from);
  return text.replace(at, from.size(), to);
}

}  // namespace knuckle::test
