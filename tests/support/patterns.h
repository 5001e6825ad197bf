// Regular expressions for tests: <regex> costs every file that includes it three seconds of compiling.
#pragma once

#include <string>
#include <vector>

namespace knuckle::test {

/// What the expression matches in a text, in its order: the whole, then its groups.
[[nodiscard]] std::vector<std::vector<std::string>> matches(const std::string& text, const std::string& expression);

[[nodiscard]] bool has_match(const std::string& text, const std::string& expression);

/// The first match exchanged. @throws std::runtime_error where there is none.
[[nodiscard]] std::string with_match_replaced(const std::string& text, const std::string& expression,
                                              const std::string& to);

}  // namespace knuckle::test
