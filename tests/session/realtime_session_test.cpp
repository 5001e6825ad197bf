// Sessions in real threads. How late they run depends on the computer and is reported, not tested.
#include "app/session/realtime_session.h"

#include <gtest/gtest.h>

#include "app/session/session_result.h"
#include "app/session/wire_latency.h"
#include "core/error.h"
#include "transport/canopen.h"

namespace knuckle::session {
namespace {

TEST(WireLatency, ReadsBeginningAndEndFromTheFrames) {
  BusDescription bus;
  bus.pressures.back().id = 0x25;
  bus.valves.back().id = 0x12;
  const auto at = [](int ms) { return Time(ms * 1ms); };
  const CanFrame pressure{.id = canopen::tpdo1_id(0x25)}, set_point{.id = canopen::rpdo1_id(0x12)}, other{.id = 0x80};
  const FrameLog frames{{at(2), pressure}, {at(4), other}, {at(7), pressure}, {at(8), set_point}, {at(18), set_point}};
  WireSpans spans;
  spans.measured = {{at(1), at(1)}, {at(5), at(5)}, {at(10), at(10)}};  // Nothing was measured before the first.
  spans.felt = {{at(5), at(6)}, {at(10), at(12)}};
  spans.acted = {{at(3), at(5)}, {at(9), at(10)}, {at(14), at(15)}};  // The last two leave in one frame.
  HopHistograms hops;
  add_wire_latencies(frames, bus, spans, hops);
  EXPECT_EQ(hops.pressure_to_slave.count(), 2u);
  EXPECT_EQ(hops.pressure_to_slave.max(), 3ms);
  EXPECT_EQ(hops.pressure_to_hand.count(), 2u);
  EXPECT_EQ(hops.pressure_to_hand.max(), 5ms);
  EXPECT_EQ(hops.hand_to_valve.count(), 2u);
  EXPECT_EQ(hops.hand_to_valve.max(), 9ms);
}

SimulateOptions realtime(const std::string& scenario) {
  SimulateOptions options;
  options.scenario = scenario;
  options.realtime = true;
  options.duration_s = 2;
  return options;
}

TEST(RealtimeSessionThreads, SameLoopsMeetOverRealSocketsAndThreads) {
  const SessionResult result = run_simulation(realtime("free_motion"), {});
  ASSERT_EQ(result.loops.size(), 4u);
  for (const LoopTiming& loop : result.loops) {
    EXPECT_TRUE(loop.policy.starts_with("SCHED_")) << loop.loop << ": " << loop.policy;
    EXPECT_GT(loop.execution_us.max, 0) << loop.loop;
  }
  const auto& samples = result.record.samples;
  ASSERT_GT(samples.size(), 2u);
  for (std::size_t i = 1; i < samples.size(); ++i) ASSERT_GT(samples[i].t_s, samples[i - 1].t_s);
  EXPECT_TRUE(result.notes.empty());
  EXPECT_NE(samples.back().machine.mode, Mode::kOff) << "the slave did not hear its nodes";
  for (const HopLatency& hop : result.hops) {
    // Nothing goes to the valves before the operator has engaged, which a slow computer may not reach.
    EXPECT_TRUE(hop.samples > 0 || hop.hop == "hand_to_valve") << hop.hop;
  }
}

TEST(RealtimeSessionThreads, SaysThatTheTwoEndsDoNotMeet) {
  SimulateOptions apart = realtime("free_motion");
  apart.duration_s = 1;
  apart.connect = "127.0.0.1:9";
  const SessionResult result = run_simulation(apart, {});
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_EQ(result.notes[0],
            "no message of the operator's side arrived over the link: --connect 127.0.0.1:9 does not lead to --listen "
            "127.0.0.1:0");
}

TEST(RealtimeSession, RefusesWhatNeedsVirtualTime) {
  EXPECT_THROW((void)run_simulation(realtime("link_faults"), {}), InputError);
  SimulateOptions delayed = realtime("free_motion");
  delayed.delay_ms = 10;
  EXPECT_THROW((void)run_simulation(delayed, {}), InputError);
}

}  // namespace
}  // namespace knuckle::session
