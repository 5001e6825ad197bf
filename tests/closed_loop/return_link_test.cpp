// A link that is dead on the way back only: the machine hears its operator, who feels and sees nothing of it.
#include <gtest/gtest.h>

#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

constexpr int kMoving = 1;
constexpr double kCutAfter_s = 2.3, kCutLasts_s = 1.5;
constexpr double kHolds_s = 0.55;   // the longest round trip of 0.5 s, and what it takes to notice
constexpr double kCloses_s = 0.15;  // the spools, once the command is neutral

/// Engage, then sweep while the way back dies and returns.
session::SessionSetup story(std::uint64_t seed) {
  session::SessionSetup setup = session_setup("link_faults", seed);
  sim::Phase engage, sweep = phase_named(setup.scenario, "cut_back");
  engage.kind = sim::PhaseKind::kEngage;
  sweep.duration_s = kCutAfter_s + kCutLasts_s;
  setup.scenario.phases = {engage, sweep, engage};
  setup.scenario.phase_names = {"engage", "moving", "again"};
  setup.scenario.faults = {{sim::FaultKind::kLinkCutBack, kMoving, kCutAfter_s, kCutLasts_s, 0}};
  setup.scenario.duration_s = 30;
  return setup;
}

TEST(ReturnLink, MachineHoldsWhileTheOperatorHearsNothingOfIt) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto record = run_session(story(seed)).record;
    const auto begun = std::find_if(record.samples.begin(), record.samples.end(),
                                    [](const session::Sample& s) { return s.phase == kMoving; });
    ASSERT_NE(begun, record.samples.end());
    const double cut_s = begun->t_s + kCutAfter_s;
    bool moved = false;
    for (const session::Sample& s : record.samples) {
      if (s.t_s < cut_s) moved = moved || (s.t_s > cut_s - 0.1 && s.machine.valve_command.cwiseAbs().maxCoeff() > 0.1);
      if (s.t_s < cut_s + kHolds_s || s.t_s >= cut_s + kCutLasts_s) continue;
      ASSERT_EQ(s.machine.mode, Mode::kHold) << s.t_s - cut_s;
      ASSERT_EQ(s.machine.blocking.code, ReasonCode::kRoundTripTooLong);
      ASSERT_EQ(s.machine.valve_command.cwiseAbs().maxCoeff(), 0);
      if (s.t_s > cut_s + kHolds_s + kCloses_s) {
        ASSERT_LT(s.truth.spool.cwiseAbs().maxCoeff(), 0.11);
      }
    }
    EXPECT_TRUE(moved) << "nothing moved that a hold could stop";
    EXPECT_TRUE(record.faults.empty());
    EXPECT_EQ(record.phases_timed_out, 0) << "and once it returns, the hand leads again";
  }
}

}  // namespace
}  // namespace knuckle::test
