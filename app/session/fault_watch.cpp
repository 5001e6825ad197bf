#include "app/session/fault_watch.h"

#include <algorithm>

namespace knuckle::session {
namespace {

constexpr Duration kOnItsWay = 10ms;  // a set-point may be on its way to the wire when the fault latches

}  // namespace

void FaultWatch::step(Time now, Mode mode, const Reason& fault, bool enable) noexcept {
  for (Latched& latch : latched_) {
    latch.released = latch.released || !enable;
    if (latch.released && enable) latch.resumed_at = std::min(latch.resumed_at, now);
  }
  const bool latched_now = mode == Mode::kFault || mode == Mode::kEStop;
  if (latched_now && !was_latched_) keep(latched_, {fault, now}, lost_);
  was_latched_ = latched_now;
}

void FaultWatch::judge(const FrameLog& frames, const MachineDescription& machine, Time end,
                       const std::function<Cause(Time)>& cause_of, SessionRecord& record) const {
  record.records_lost += lost_;
  const auto seconds = [](const std::optional<Time>& t) { return t ? to_seconds(*t) : 0; };
  for (const Latched& latch : latched_) {
    const auto [last_good, injected_at] = cause_of(latch.at);
    const Time until = std::min(latch.resumed_at, end);
    const NeutralTimes neutral = neutral_times(frames, machine, last_good, until);
    record.faults.push_back({latch.reason,
                             to_seconds(latch.at),
                             to_seconds(last_good),
                             seconds(neutral.command),
                             seconds(neutral.spool),
                             neutral.controller_silent,
                             {}});
    if (injected_at) record.faults.back().injected_s = to_seconds(*injected_at);
    if (commands_not_neutral(frames, machine, latch.at + kOnItsWay, until) > 0) ++record.resumed_by_itself;
  }
}

}  // namespace knuckle::session
