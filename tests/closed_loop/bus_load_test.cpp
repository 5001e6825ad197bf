// How full the machine's bus is in a session: measured from the recorded frames by their own bits, against what the
// machine file's map promises. Start-up is fuller: nodes are set up by SDO as fast as they answer, before anything
// moves.
#include <gtest/gtest.h>

#include <cstdio>
#include <sstream>

#include "slave/bus_map.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/candump.h"
#include "transport/virtual_can.h"

namespace knuckle::test {
namespace {

constexpr double kMostLoad = 0.60;

/// The session's candump log, read back as anybody would.
std::vector<WireFrame> logged(const session::FrameLog& frames) {
  std::stringstream log;
  for (const TimedFrame& f : frames) log << candump_line(f.at, f.frame) << '\n';
  return read_candump(log);
}

CanFrame frame_of(const WireFrame& wire) {
  CanFrame frame{wire.id, static_cast<std::uint8_t>(wire.data.size()), {}};
  std::copy(wire.data.begin(), wire.data.end(), frame.data.begin());
  return frame;
}

TEST(BusLoad, MeasuredInOperationLiesWhereTheMapSaysAndNeverAboveSixtyPercent) {
  session::SessionSetup setup = session_setup("free_motion", 1);
  setup.scenario.duration_s = 8;
  const FinishedSession session = run_session(setup);
  const BusDescription& bus = setup.machine.bus;
  const auto wire = logged(session.frames);
  ASSERT_GT(wire.size(), 10000U);
  constexpr double kOperational_s = 3;
  CanLoadMeter whole(bus.bit_rate), operation(bus.bit_rate);
  for (const WireFrame& w : wire) {
    const Time at{from_seconds(w.at_s)};
    whole.add(at, frame_of(w));
    if (w.at_s >= kOperational_s) operation.add(at, frame_of(w));
  }
  const CanLoad computed = can_load(slave::bus_map(bus), bus.bit_rate);
  std::printf(
      "computed %.1f %% ... %.1f %% worst stuffed; measured %.1f %%, busiest 100 ms %.1f %%, start-up %.1f %%\n",
      100 * computed.least, 100 * computed.worst_case, 100 * operation.mean(), 100 * operation.busiest(),
      100 * whole.busiest());
  EXPECT_GE(operation.mean(), computed.least - 0.002);  // heartbeats at the ends
  EXPECT_LE(operation.mean(), computed.worst_case);
  EXPECT_LE(computed.worst_case, kMostLoad);
  EXPECT_LE(operation.busiest(), kMostLoad);
}

}  // namespace
}  // namespace knuckle::test
