// Sessions in real threads. How late they run depends on the computer and is reported, not tested.
#include <gtest/gtest.h>

#include "app/session/session.h"
#include "app/session/session_logs.h"
#include "app/session/session_result.h"
#include "core/error.h"
#include "tests/support/says.h"

namespace knuckle::session {
namespace {

TEST(WireLatency, ReadsBeginningAndEndFromTheFrames) {
  const auto at = [](int ms) { return Time(ms * 1ms); };
  const CanFrame pressure{.id = 0x1A5}, set_point{.id = 0x212}, other{.id = 0x80};
  const FrameLog frames{{at(2), pressure}, {at(4), other}, {at(7), pressure}, {at(8), set_point}, {at(18), set_point}};
  // Nothing was measured before the first.
  const Histogram measured = since_frame(frames, pressure.id, {{at(1), at(1)}, {at(5), at(5)}, {at(10), at(10)}});
  EXPECT_EQ(measured.count(), 2u);
  EXPECT_EQ(measured.max(), 3ms);
  EXPECT_EQ(since_frame(frames, pressure.id, {{at(5), at(6)}, {at(10), at(12)}}).max(), 5ms);
  // The last two leave in one frame.
  const Histogram acted = until_frame(frames, set_point.id, {{at(3), at(5)}, {at(9), at(10)}, {at(14), at(15)}});
  EXPECT_EQ(acted.count(), 2u);
  EXPECT_EQ(acted.max(), 9ms);
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
  EXPECT_TRUE(test::says(result.notes[0], "--connect 127.0.0.1:9 does not lead to --listen 127.0.0.1:0"));
}

TEST(RealtimeSession, RefusesWhatNeedsVirtualTime) {
  EXPECT_THROW((void)run_simulation(realtime("link_faults"), {}), InputError);
  SimulateOptions delayed = realtime("free_motion");
  delayed.delay_ms = 10;
  EXPECT_THROW((void)run_simulation(delayed, {}), InputError);
}

}  // namespace
}  // namespace knuckle::session
