// Every frame that was on the CAN wire, with its time; and what a judge reads from it: when the machine was neutral.
#pragma once

#include <optional>
#include <vector>

#include "core/time.h"
#include "machine/description_fwd.h"
#include "transport/timed_frame.h"

namespace knuckle::session {

using FrameLog = std::vector<TimedFrame>;

/// Since when the valves were told to be neutral, and since when their spools were, to stay so. nullopt: not by
/// `until`.
struct NeutralTimes {
  std::optional<Time> command;     ///< Each valve's newest RPDO is a zero set-point or not ACTIVE.
  std::optional<Time> spool;       ///< Each valve's newest TPDO shows a spool inside its nominal dead band; of a valve
                                   ///< that has gone silent: pilot pressure has been off for 100 ms.
  bool controller_silent = false;  ///< From `from` the controller put nothing on the wire for as long as the valves'
                                   ///< watchdog, nor before the spools were neutral: there was no command to judge,
                                   ///< the nodes acted by themselves.
};

/// Reads frames in [from, until). The state at `from` is that of the last frames before it.
[[nodiscard]] NeutralTimes neutral_times(const FrameLog& log, const MachineDescription& machine, Time from, Time until);

/// Time of the last frame with this identifier before `before`.
[[nodiscard]] std::optional<Time> last_frame_before(const FrameLog& log, std::uint32_t id, Time before);

/// Last time before `before` at which the spool was within 10 % of stroke of the span of its newest six demands.
[[nodiscard]] std::optional<Time> last_following(const FrameLog& log, const MachineDescription& machine, int joint,
                                                 Time before);

/// Set-points that are not neutral in [from, until): nobody may move the machine there.
[[nodiscard]] int commands_not_neutral(const FrameLog& log, const MachineDescription& machine, Time from, Time until);

}  // namespace knuckle::session
