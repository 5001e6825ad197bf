// The shipped machine's file, and texts with something else in them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/keyed_nodes.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

/// Whether it has this part; where not, the test says so with the text.
inline ::testing::AssertionResult has_text(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess() << "it has '" << part << "'";
  return ::testing::AssertionFailure() << "no '" << part << "' in:\n" << text;
}
/// Whether one of them has.
inline ::testing::AssertionResult has_text(const std::vector<std::string>& lines, const std::string& part) {
  std::string all;
  for (const std::string& line : lines) all += line + '\n';
  return has_text(all, part);
}

inline std::string solar_text() {
  return content(source_dir() + "/config/machines/solar015.toml");
}
/// The same machine in the older words.
inline std::string keyed() {
  return with_keyed_nodes(solar_text());
}

/// `text` with `to` in place of the first `from`, which must be there.
inline std::string changed(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}
/// In place of each.
inline std::string all_changed(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}
inline std::string with_crlf(const std::string& text) {
  return all_changed(text, "\n", "\r\n");
}

}  // namespace knuckle::test
