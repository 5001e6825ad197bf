// What a session keeps while it runs: one book for each loop, so that a loop with a thread of its own writes alone.
// Room is made beforehand; what there is no room for is counted, or left out of the latencies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session.h"
#include "app/session/session_record.h"
#include "app/session/wire_latency.h"
#include "core/histogram.h"
#include "core/time.h"
#include "master/master_loop.h"
#include "sim/world.h"
#include "slave/slave_loop.h"

namespace knuckle::session {

/// Latencies that end at the operator, and what the operator is warned of.
struct MasterBook {
  /// @param rows steps of the slave there is room for. @param far_origin of the slave's stamps.
  MasterBook(std::size_t rows, Duration far_origin);
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
struct SlaveBook {
  /// @param far_origin of the master's stamps.
  SlaveBook(std::size_t rows, Duration far_origin);
  /// After every slave step.
  void note(Time now, const slave::SlaveLoop& slave) noexcept;

  Duration far_origin;
  Histogram master_to_slave;
  std::vector<Span> measured, acted;
  std::uint32_t heard = 0;
};

/// Frames on the wire and events of the world.
struct MachineBook {
  explicit MachineBook(std::size_t most_frames);
  void note(Time at, const CanFrame& frame) noexcept { keep(frames, {at, frame}, lost); }
  /// After every step of the plant.
  void note(const sim::WorldEventRing& ring) noexcept;
  /// Adds events, and how much was lost, to the record.
  void hand_over(SessionRecord& record) const;

  FrameLog frames;
  std::vector<sim::WorldEvent> events;
  std::uint64_t events_read = 0, lost = 0;
  int breaks = 0;  ///< Pieces that gave way so far.
};

/// All hops, those on the CAN wire read from its frames. After the loops have ended.
[[nodiscard]] HopHistograms hops_of(const MasterBook& master, const SlaveBook& slave, const MachineBook& machine,
                                    const BusDescription& bus);

}  // namespace knuckle::session
