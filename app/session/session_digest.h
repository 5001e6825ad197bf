// Whether two sessions are the same: SHA-256 of each field over all rows, and of all CAN frames. A new field is a new
// line and leaves those of the others as they are.
#pragma once

#include <string>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session_record.h"

namespace knuckle::session {

struct SessionDigest {
  struct Line {
    std::string field;   ///< "truth_tip_m"; "frames": of the bus.
    std::string digest;  ///< The first 16 digits.
  };
  std::vector<Line> lines;
  std::string whole;  ///< Hex, of all lines: equal ones mean equal sessions.
};

[[nodiscard]] SessionDigest digest_of(const std::vector<Sample>& rows, const FrameLog& frames);

}  // namespace knuckle::session
