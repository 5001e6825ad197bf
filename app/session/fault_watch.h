// Which faults latched during a session, and what the CAN frames say the machine did then.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session_record.h"
#include "core/reason.h"
#include "core/time.h"
#include "machine/description_fwd.h"

namespace knuckle::session {

/// What is taken for the cause of a fault.
struct Cause {
  Time last_good_input{};
  std::optional<Time> injected_at;  ///< nullopt: nothing was broken on purpose.
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
