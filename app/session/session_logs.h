// What a session keeps while it runs: one log for each loop, so that a loop with a thread of its own writes alone. Room
// is made beforehand; what there is no room for is counted, or left out of the latencies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session.h"
#include "app/session/session_record.h"
#include "core/histogram.h"
#include "core/time.h"
#include "master/master_loop.h"
#include "sim/world.h"
#include "slave/slave_loop.h"

namespace knuckle::session {

/// A loop did something at `to` with what was there at `from`.
struct Span {
  Time from{}, to{};
};

/// Latencies that end at the operator, and what the operator is warned of.
struct MasterLog {
  /// @param rows steps of the slave there is room for. @param far_origin of the slave's stamps.
  MasterLog(std::size_t rows, Duration far_origin);
  /// After every master step.
  void note(Time now, const master::MasterLoop& master) noexcept;
  /// Adds warnings to the record.
  void hand_over(SessionRecord& record) const;

  Duration far_origin;
  Histogram slave_to_master, hand_to_master;
  std::vector<Span> felt;
  Time felt_sensor_at = kNever;
  std::uint32_t heard = 0;  ///< Sequence of the newest message.
  std::vector<WarningRecord> warnings;
  Reason warned;
  std::uint64_t lost = 0;  ///< Warnings.
};

/// Latencies that end at the machine's side.
struct SlaveLog {
  /// @param far_origin of the master's stamps.
  SlaveLog(std::size_t rows, Duration far_origin);
  /// After every slave step.
  void note(Time now, const slave::SlaveLoop& slave) noexcept;

  Duration far_origin;
  Histogram master_to_slave;
  std::vector<Span> measured, acted;
  std::uint32_t heard = 0;
};

/// Frames on the wire and events of the world.
struct MachineLog {
  explicit MachineLog(std::size_t most_frames);
  /// Those of two buses come in the order of time on each.
  void note(Time at, const CanFrame& frame) noexcept;
  /// After every step of the plant.
  void note(const sim::WorldEventRing& ring) noexcept;
  /// Adds events, and how much was lost, to the record.
  void hand_over(SessionRecord& record) const;

  FrameLog frames;
  std::vector<sim::WorldEvent> events;
  std::uint64_t events_read = 0, lost = 0;
  int breaks = 0;  ///< Pieces that gave way so far.
};

/// From the last frame with this identifier at or before each span's start, to its end.
[[nodiscard]] Histogram since_frame(const FrameLog& frames, std::uint32_t id, const std::vector<Span>& spans);
/// From each span's start to the first frame with this identifier at or after its end; where several lead to one frame,
/// the first counts.
[[nodiscard]] Histogram until_frame(const FrameLog& frames, std::uint32_t id, const std::vector<Span>& spans);

inline constexpr double kTail_s = 0.5;  ///< Recorded after the operator has finished.

/// Those of one session, and what they come to.
struct SessionLogs {
  /// @param spare_s for which it may go on after its scenario's time.
  explicit SessionLogs(const SessionSetup& setup, double spare_s = 0);
  /// After every step of the slave. @param enable as the operator presses it.
  void note_faults(Time now, const slave::SlaveLoop& loop, bool enable) noexcept {
    faults.step(now, loop.mode(), loop.fault(), enable);
  }
  /// The row of a step of the slave.
  void note(const Sample& sample) noexcept { keep(record.samples, sample, record.records_lost); }
  /// After the loops have ended: faults are judged and latencies read from the frames that were on the wire.
  /// @param cause_of a fault that latched at the given time.
  [[nodiscard]] SessionOutcome hand_over(const MachineDescription& machine, const sim::Operator& person, Time end,
                                         const std::function<Cause(Time latched_at)>& cause_of);

  SessionRecord record;
  MasterLog master;
  SlaveLog slave;
  MachineLog machine;
  FaultWatch faults;
};

}  // namespace knuckle::session
