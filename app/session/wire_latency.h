// Latencies that begin or end on the CAN wire, read from the frames that were on it.
#pragma once

#include <vector>

#include "app/session/frame_log.h"
#include "app/session/session.h"
#include "core/time.h"
#include "machine/bus_description.h"

namespace knuckle::session {

/// A loop did something at `to` with what was there at `from`.
struct Span {
  Time from{}, to{};
};

/// What began or ended on the CAN wire, each in order of time; see HopHistograms.
struct WireSpans {
  std::vector<Span> measured;  ///< Slave step to itself.
  std::vector<Span> acted;     ///< Device report to the slave step that acted on it.
  std::vector<Span> felt;      ///< Slave step that estimated a force to the master step that rendered it.
};

/// Fills pressure_to_slave, pressure_to_hand (from the last pressure frame of a cycle) and hand_to_valve (to the last
/// set-point frame of a cycle; where several reports lead to one frame, the oldest counts).
void add_wire_latencies(const FrameLog& frames, const BusDescription& bus, const WireSpans& spans, HopHistograms& hops);

}  // namespace knuckle::session
