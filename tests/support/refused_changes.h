// Files that are wrong in one place, and what is said of each.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "machine/load.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::test {

/// What is said of a machine file of this text, called "m.toml"; "accepted" where nothing is.
inline std::string machine_refusal(const std::string& text) {
  return refusal([&] { (void)parse_machine(text, "m.toml"); });
}

struct RefusedChange {
  std::string from, to, said;
};

/// Each is refused in one line that begins with the file, "m.toml".
/// @param read the file with `to` in place of the first `from`
inline void expect_refused(const std::vector<RefusedChange>& changes,
                           const std::function<void(const std::string& from, const std::string& to)>& read) {
  for (const RefusedChange& change : changes) {
    const std::string line = refusal([&] { read(change.from, change.to); });
    EXPECT_TRUE(says(line, change.said)) << change.to;
    EXPECT_TRUE(begins(line, "m.toml:")) << change.to;
    EXPECT_FALSE(says(line, "\n")) << change.to;
  }
}

}  // namespace knuckle::test
