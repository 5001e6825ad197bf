// How long each limit held the machine back in a session.
#pragma once

#include <string>
#include <vector>

#include "app/session/session_record.h"
#include "machine/description.h"

namespace knuckle::session {

struct LimitTime {
  std::string limit;  ///< As limit_word() says; a virtual wall by its own name: "floor", "ceiling", "reach".
  bool wall = false;
  double time_s = 0;
};

/// Every limit, also those that were never met, in the order of LimitFlag. Several may hold at one time.
[[nodiscard]] std::vector<LimitTime> limit_times(const SessionRecord& record, const LimitsDescription& limits);

}  // namespace knuckle::session
