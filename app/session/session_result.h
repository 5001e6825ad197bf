// The result of a session: what ran, what happened, how to judge and draw it. Every output is written from this.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/metrics.h"
#include "app/session/options.h"
#include "app/session/scene.h"
#include "app/session/session.h"
#include "app/session/session_record.h"
#include "machine/description.h"
#include "recording/recorder.h"

namespace knuckle::session {

/// Whether two sessions are the same: SHA-256 of each field over all rows, and of all CAN frames. A new field is a new
/// line and leaves those of the others as they are.
struct SessionDigest {
  struct Line {
    std::string field;   ///< "truth_tip_m"; "frames": of the bus.
    std::string digest;  ///< The first 16 digits.
  };
  std::vector<Line> lines;
  std::string whole;  ///< Hex, of all lines: equal ones mean equal sessions.
};

[[nodiscard]] SessionDigest digest_of(const std::vector<Sample>& rows, const FrameLog& frames);

struct SessionResult {
  // What ran.
  std::string scenario, machine_name, device_name, operator_name, control;
  std::string family, person;  ///< Which machines the seed sampled from; "file": a truth file. How much of a person.
  std::uint64_t seed = 0, machine_seed = 0;
  double delay_ms = 0, jitter_ms = 0, loss = 0, bursts_per_s = 0;
  std::string impairment;          ///< Link file, as it was named; empty: none.
  std::vector<std::string> notes;  ///< What was done to the inputs (gaps filled, angles scaled): shown everywhere.
  // What happened.
  SessionRecord record;
  SessionDigest digest;
  double simulated_s = 0, wall_s = 0;
  std::vector<HopLatency> hops;
  std::vector<LoopTiming> loops;  ///< Empty on virtual time.
  recording::RecorderStatus log;  ///< Of the recording and flight records, where they were asked for.
  // How to judge and draw it.
  std::vector<Criterion> criteria;
  bool requirements_decide = true;
  MachineDescription machine;
  Scene scene;
};

/// What the session reports to while it runs.
struct SessionHooks {
  std::function<void(double done_fraction)> progress;  ///< A few times a second; may throw to end the session.
  /// Once the recording and flight records are complete, also of a session that `progress` ended.
  std::function<void(const recording::RecorderStatus&)> recorded;
  std::ostream* candump = nullptr;  ///< Every CAN frame, candump log format; null: not wanted.
};

/// Runs one session. @throws InputError for bad scenario, machine, device, map or motion files.
[[nodiscard]] SessionResult run_simulation(const SimulateOptions& options, const SessionHooks& hooks);

/// A result and its verdict: what every output is written from.
struct Judged {
  const SessionResult& session;
  Metrics metrics;
  std::vector<CriterionResult> criteria;
  std::optional<bool> passed;  ///< Null: cut short, and nothing unsafe until then.
};
[[nodiscard]] Judged judge(const SessionResult& session);

}  // namespace knuckle::session
