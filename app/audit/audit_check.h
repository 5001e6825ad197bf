// Whether an audit trail is as it was written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/audit/audit_files.h"
#include "app/cli/command.h"

namespace knuckle::audit {

struct Check {
  std::vector<std::string> lines;  ///< All that are there, oldest first.
  std::vector<std::string> notes;  ///< What is worth knowing and breaks nothing: removed by rotation, unfinished lines.
  /// "FILE:LINE: why" of all breaks, but in each file only of the first: more may follow from it. Empty: the chain is
  /// whole.
  std::vector<std::string> breaks;
  std::size_t files = 0;
  Head last;  ///< Number 0 where there is no line.
  /// The first break; empty where there is none.
  [[nodiscard]] std::string broken() const { return breaks.empty() ? "" : breaks.front(); }
};
/// @throws InputError where folder or files cannot be read.
[[nodiscard]] Check check_trail(const std::string& folder);

/// A line of a Check for people, printable: "2026-11-25T07:08:09.123Z connected: name=desk 1, fingerprint=QF3K-..."
[[nodiscard]] std::string readable(const std::string& line);

/// Exit codes: 0 the chain is whole, 1 it is broken.
[[nodiscard]] cli::Command audit_entry();

}  // namespace knuckle::audit
