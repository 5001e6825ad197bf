#include "app/fault_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace knuckle::app {

void FaultWatch::step(Time now, Mode mode, const Reason& fault, bool enable) noexcept {
  for (Latched& latch : latched_) {
    if (latch.released_at == Time::max() && !enable) latch.released_at = now;
  }
  const bool latched_now = mode == Mode::kFault || mode == Mode::kEStop;
  if (latched_now && !was_latched_ && latched_.size() < latched_.capacity()) latched_.push_back({fault, now});
  was_latched_ = latched_now;
}

void FaultWatch::judge(const FrameLog& frames, const MachineDescription& machine, Time end,
                       const std::function<Time(Time)>& last_good_input, SessionRecord& record) const {
  const auto seconds = [](const std::optional<Time>& t) {
    return t ? to_seconds(*t) : std::numeric_limits<double>::quiet_NaN();
  };
  for (const Latched& latch : latched_) {
    const Time last_good = last_good_input(latch.at);
    const NeutralTimes neutral = neutral_times(frames, machine, last_good, std::min(latch.released_at, end));
    record.faults.push_back(
        {latch.reason, to_seconds(latch.at), to_seconds(last_good), seconds(neutral.command), seconds(neutral.spool)});
    if (neutral.command && commands_not_neutral(frames, machine, *neutral.command, latch.released_at) > 0) {
      ++record.resumed_by_itself;
    }
  }
}

}  // namespace knuckle::app
