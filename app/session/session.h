// One teleoperation session: operator, device, master, link, slave, bus and machine. On virtual time in lock-step, one
// millisecond a step, in one thread; or the same loop objects in real-time threads. Above the wires nothing knows that
// it is simulated.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session_record.h"
#include "app/session/session_setup.h"
#include "core/histogram.h"
#include "recording/recorder.h"

namespace knuckle::session {

struct Percentiles {
  double p50 = 0, p99 = 0, max = 0;
};
[[nodiscard]] Percentiles percentiles_us(const Histogram& histogram);

/// One hop of the latency chain, in the session's time (virtual, or real with --realtime); from the stamps that travel
/// with each sample.
struct HopLatency {
  std::string hop;  ///< snake_case, such as "hand_to_valve"
  std::uint64_t samples = 0;
  Percentiles latency_us;
};

/// One real-time loop as it ran; with --realtime only.
struct LoopTiming {
  std::string loop;    ///< "master", "slave", ...
  std::string policy;  ///< Scheduling class granted.
  Percentiles wake_us, execution_us;
  std::uint64_t overruns = 0;
};

/// What a run leaves, on virtual or real time.
struct SessionOutcome {
  SessionRecord record;
  FrameLog frames;
  std::vector<HopLatency> hops;
  bool heard = false;             ///< The machine's side heard the operator's.
  std::vector<LoopTiming> loops;  ///< Empty on virtual time.
  double elapsed_s = 0;
};

class Session {
 public:
  /// @throws InputError where the setup does not fit together. Allocates all that steps need.
  explicit Session(const SessionSetup& setup);
  ~Session();

  /// Before the first step: all that its loops read, do and know goes there. @param recorder outlives this; whoever
  /// steps the session drains it.
  void record_to(recording::Recorder& recorder);

  /// One millisecond. Allocates nothing.
  void step() noexcept;
  [[nodiscard]] bool done() const noexcept;
  [[nodiscard]] double elapsed_s() const noexcept;
  /// Share of the scenario done, for progress: by phases.
  [[nodiscard]] double done_fraction() const noexcept;

  /// Judges faults from the recorded frames and hands everything over; the session is over then.
  [[nodiscard]] SessionOutcome take_outcome();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Runs a session in real-time threads to its end: operator with device, master, slave and machine each in their own,
/// over UDP on the loopback interface and lock-free CAN and HID wires. Takes as long as it lasts. The link is the
/// loopback interface as it is: impairment and scheduled faults belong to virtual time.
/// @param progress called a few times a second with the share done; may throw to end the session.
/// @param recorder all that the loops read, know and do; null: not wanted. Drained meanwhile.
/// @throws InputError where the scenario schedules faults, or the set-up does not fit together.
[[nodiscard]] SessionOutcome run_realtime(const SessionSetup& setup, recording::Recorder* recorder,
                                          const std::function<void(double)>& progress);

}  // namespace knuckle::session
