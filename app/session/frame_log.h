// Every frame that was on the CAN wire, with its time, and what a judge reads from it: when the machine was neutral,
// and what it did after each fault that latched.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "app/session/session_record.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "transport/timed_frame.h"

namespace knuckle::session {

using FrameLog = std::vector<TimedFrame>;

/// Since when the valves were told to be neutral, and since when their spools were, to stay so. nullopt: not by
/// `until`.
struct NeutralTimes {
  std::optional<Time> command;     ///< The newest frame for each joint tells it 0, or its valve not to be ACTIVE.
  std::optional<Time> spool;       ///< Each valve's newest TPDO shows a spool inside its nominal dead band; of a valve
                                   ///< that has gone silent: pilot pressure has been off for 100 ms.
                                   ///< Of a machine that tells no spools nothing here.
  bool controller_silent = false;  ///< From `from` the controller put nothing on the wire for as long as the valves'
                                   ///< watchdog, nor before the spools were neutral: there was no command to judge,
                                   ///< the nodes acted by themselves.
};

/// Reads frames in [from, until). The state at `from` is that of the last frames before it.
[[nodiscard]] NeutralTimes neutral_times(const FrameLog& log, const MachineDescription& machine, Time from, Time until);

/// Time of the last frame with this identifier before `before`.
[[nodiscard]] std::optional<Time> last_frame_before(const FrameLog& log, std::uint32_t id, Time before);

/// Time of the first frame from `from` on; Time::max() where there is none.
[[nodiscard]] Time first_frame_from(const FrameLog& log, Time from);

/// Last time before `before` at which the spool was within 10 % of stroke of the span of its newest six demands.
[[nodiscard]] std::optional<Time> last_following(const FrameLog& log, const MachineDescription& machine, int joint,
                                                 Time before);

/// Set-points that are not neutral in [from, until): nobody may move the machine there.
[[nodiscard]] int commands_not_neutral(const FrameLog& log, const MachineDescription& machine, Time from, Time until);

/// What is taken for the cause of a fault.
struct Cause {
  Time last_good_input{};
  std::optional<Time> injected_at;  ///< nullopt: nothing was broken on purpose.
  /// Where the wire is another thread's, when that first ran after the fault: what was sent before comes only then.
  Time wire_ran_at = Time::min();
};

class FaultWatch {
 public:
  FaultWatch() { latched_.reserve(64); }

  /// Every slave step. Allocates nothing; faults beyond the reserve are counted as lost records.
  void step(Time now, Mode mode, const Reason& fault, bool enable) noexcept;

  /// Adds a FaultRecord for each, judged from the frames, and counts machines that moved again by themselves.
  /// @param cause_of a fault that latched at the given time.
  void judge(const FrameLog& frames, const MachineDescription& machine, Time end,
             const std::function<Cause(Time latched_at)>& cause_of, SessionRecord& record) const;

 private:
  struct Latched {
    Reason reason;
    Time at{};
    bool released = false;          ///< The operator has let go of enable since.
    Time resumed_at = Time::max();  ///< When it was pressed again after that: before, nobody may move the machine.
  };
  std::vector<Latched> latched_;
  std::uint64_t lost_ = 0;
  bool was_latched_ = false;
};

}  // namespace knuckle::session
