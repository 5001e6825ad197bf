// The loops of a session in real-time threads: operator with device, master, slave and machine each in their own, over
// UDP on the loopback interface and lock-free CAN and HID wires. The loop objects are those of app/session/session.h.
#pragma once

#include <functional>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session.h"
#include "app/session/session_record.h"
#include "app/session/session_result.h"

namespace knuckle::session {

/// What a run leaves, on virtual or real time.
struct SessionOutcome {
  SessionRecord record;
  FrameLog frames;
  HopHistograms hops;
  std::vector<LoopTiming> loops;  ///< Empty on virtual time.
  double elapsed_s = 0;
};

/// Runs the session to its end; takes as long as it lasts. The link is the loopback interface as it is: impairment and
/// scheduled faults belong to virtual time.
/// @param progress called a few times a second with the share done; may throw to end the session.
/// @param recorder all that the loops read, know and do; null: not wanted. Drained meanwhile.
/// @throws InputError where the scenario schedules faults, or the set-up does not fit together.
[[nodiscard]] SessionOutcome run_realtime(const SessionSetup& setup, recording::Recorder* recorder,
                                          const std::function<void(double)>& progress);

}  // namespace knuckle::session
