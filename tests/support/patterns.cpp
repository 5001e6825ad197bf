#include "tests/support/patterns.h"

#include <regex>
#include <stdexcept>

namespace knuckle::test {

std::vector<std::vector<std::string>> matches(const std::string& text, const std::string& expression) {
  const std::regex regex(expression);
  std::vector<std::vector<std::string>> found;
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at)
    found.emplace_back(at->begin(), at->end());
  return found;
}

bool has_match(const std::string& text, const std::string& expression) {
  return std::regex_search(text, std::regex(expression));
}

std::string with_match_replaced(const std::string& text, const std::string& expression, const std::string& to) {
  if (!has_match(text, expression)) throw std::runtime_error("no match of " + expression);
  return std::regex_replace(text, std::regex(expression), to, std::regex_constants::format_first_only);
}

}  // namespace knuckle::test
