// The shipped machine's file, and texts with something else in them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/keyed_nodes.h"
#include "tests/support/replaced.h"
#include "tests/support/says.h"
#include "tests/support/shipped.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

/// Whether one of them says it.
inline ::testing::AssertionResult says(const std::vector<std::string>& lines, const std::string& part) {
  std::string all;
  for (const std::string& line : lines) all += line + '\n';
  return says(all, part);
}

/// The machine solar015 in the older words.
inline std::string keyed() {
  return with_keyed_nodes(shipped_text());
}

/// With `to` in place of each `from`.
inline std::string all_changed(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}
inline std::string with_crlf(const std::string& text) {
  return all_changed(text, "\n", "\r\n");
}

}  // namespace knuckle::test
