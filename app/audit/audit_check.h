// Whether an audit trail is as it was written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/audit/audit_files.h"

namespace knuckle::audit {

struct Check {
  std::vector<std::string> lines;  ///< All that are there, oldest first, up to the first that is broken.
  std::vector<std::string> notes;  ///< What is worth knowing and breaks nothing: removed by rotation, unfinished lines.
  std::string broken;              ///< "FILE:LINE: why"; empty: the chain is whole.
  std::size_t files = 0;
  Head last;  ///< Number 0 where there is no line.
};
/// @throws InputError where folder or files cannot be read.
[[nodiscard]] Check check_trail(const std::string& folder);

/// A line of a Check for people, printable: "2026-11-25T07:08:09.123Z connected: name=desk 1, fingerprint=QF3K-..."
[[nodiscard]] std::string readable(const std::string& line);

}  // namespace knuckle::audit
