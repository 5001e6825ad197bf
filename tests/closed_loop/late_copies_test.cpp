// A path that is cut while another one still brings every datagram, 250 ms late: what is old is no command, and an
// outage stays one.
#include <gtest/gtest.h>

#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

constexpr int kMoving = 1, kWaiting = 2;
constexpr double kRow_s = 0.005;

/// Engage, sweep while the path dies and returns, go on holding enable for a while, engage anew.
session::SessionSetup story(std::uint64_t seed) {
  session::SessionSetup setup = session_setup("link_faults", seed);
  sim::Phase engage, sweep = phase_named(setup.scenario, "cut"), wait;
  engage.kind = sim::PhaseKind::kEngage;
  wait.kind = sim::PhaseKind::kWait;
  wait.duration_s = 2;
  setup.scenario.phases = {engage, sweep, wait, engage};
  setup.scenario.phase_names = {"engage", "moving", "waiting", "again"};
  setup.scenario.faults.clear();
  setup.scenario.duration_s = 40;
  setup.to_machine.second_path = setup.to_operator.second_path = 250ms;
  return setup;
}

double start_of(const session::SessionRecord& record, int phase) {
  for (const session::Sample& s : record.samples) {
    if (s.phase == phase) return s.t_s;
  }
  ADD_FAILURE() << "phase " << phase << " was never reached";
  return 0;
}

/// The same until the cut, so it says when the sweep is in full motion.
double in_full_motion(const session::SessionSetup& setup) {
  session::SessionSetup whole = setup;
  whole.scenario.phases.resize(2);
  whole.scenario.phase_names.resize(2);
  whole.scenario.phases[kMoving].until_fault = false;
  return start_of(run_session(whole).record, kMoving) + 2.3;
}

TEST(LateCopies, DoNotEndAnOutageNorLetAnythingResumeByItself) {
  for (const Duration outage : {240ms, 600ms}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      SCOPED_TRACE(std::to_string(outage.count() / 1000000) + " ms, seed " + std::to_string(seed));
      session::SessionSetup setup = story(seed);
      const double cut_s = in_full_motion(setup);
      for (LinkImpairment* way : {&setup.to_machine, &setup.to_operator}) {
        way->outages = {{.from = Time(from_seconds(cut_s)), .length = outage}};
      }
      const auto record = run_session(setup).record;
      ASSERT_EQ(record.faults.size(), 1U);
      EXPECT_EQ(record.faults[0].reason.code, ReasonCode::kLinkLost);
      bool moved = false;
      for (const session::Sample& s : record.samples) {
        const double most = s.machine.valve_command.cwiseAbs().maxCoeff();
        if (s.t_s < cut_s) moved = moved || (s.t_s > cut_s - 0.1 && most > 0.1);
        if (s.t_s < cut_s + 0.2 + kRow_s || s.t_s >= start_of(record, kWaiting + 1)) continue;
        ASSERT_EQ(s.machine.mode, Mode::kFault) << s.t_s - cut_s;
        ASSERT_EQ(most, 0);
      }
      EXPECT_TRUE(moved) << "nothing moved that an outage could stop";
      EXPECT_EQ(record.phases_timed_out, 0) << "and after release, press and alignment the hand leads again";
    }
  }
}

}  // namespace
}  // namespace knuckle::test
