// How full the machine's bus is in a session: measured from the recorded frames by their own bits, against what the
// machine file's map promises. Start-up is fuller: nodes are set up by SDO as fast as they answer, before anything
// moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>

#include "slave/bus_map.h"
#include "tests/closed_loop/session_rig.h"
#include "tests/support/candump.h"
#include "transport/can_load.h"
#include "transport/timed_frame.h"

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

/// Shares of the bus' time, by the bits that the frames really have.
struct MeasuredLoad {
  double mean = 0, busiest = 0;  ///< The busiest of the windows of 100 ms.
};
MeasuredLoad measured_from(double from_s, const std::vector<WireFrame>& wire, std::uint32_t bit_rate) {
  constexpr double kWindow_s = 0.1;
  std::map<int, double> bits_in_window;
  double bits = 0;
  for (const WireFrame& w : wire) {
    if (w.at_s < from_s) continue;
    bits += frame_bits(frame_of(w));
    bits_in_window[static_cast<int>((w.at_s - from_s) / kWindow_s)] += frame_bits(frame_of(w));
  }
  MeasuredLoad load{bits / ((wire.back().at_s - std::max(from_s, wire.front().at_s)) * bit_rate), 0};
  for (const auto& [window, sum] : bits_in_window) load.busiest = std::max(load.busiest, sum / (kWindow_s * bit_rate));
  return load;
}

TEST(BusLoad, MeasuredInOperationLiesWhereTheMapSaysAndNeverAboveSixtyPercent) {
  session::SessionSetup setup = session_setup("free_motion", 1);
  setup.scenario.duration_s = 8;
  const FinishedSession session = run_session(setup);
  const BusDescription& bus = setup.machine.bus;
  const auto wire = logged(session.frames);
  ASSERT_GT(wire.size(), 10000U);
  constexpr double kOperational_s = 3;
  const MeasuredLoad whole = measured_from(0, wire, bus.bit_rate),
                     operation = measured_from(kOperational_s, wire, bus.bit_rate);
  const CanLoad computed = can_load(slave::bus_map(bus), bus.bit_rate);
  std::printf(
      "computed %.1f %% ... %.1f %% worst stuffed; measured %.1f %%, busiest 100 ms %.1f %%, start-up %.1f %%\n",
      100 * computed.least, 100 * computed.worst_case, 100 * operation.mean, 100 * operation.busiest,
      100 * whole.busiest);
  EXPECT_GE(operation.mean, computed.least - 0.002);  // heartbeats at the ends
  EXPECT_LE(operation.mean, computed.worst_case);
  EXPECT_LE(computed.worst_case, kMostLoad);
  EXPECT_LE(operation.busiest, kMostLoad);
}

}  // namespace
}  // namespace knuckle::test
