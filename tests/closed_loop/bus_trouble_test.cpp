// Trouble on the machine's bus that ends in no fault: a node that is not the machine file's, and somebody who talks all
// the time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/closed_loop/session_rig.h"
#include "transport/can_load.h"

namespace knuckle::test {
namespace {

using sim::FaultKind;

constexpr std::uint32_t kSync = 0x080, kFirstSetPoint = 0x210, kLastSetPoint = 0x212, kBabbled = 0x001;
constexpr double kStep_s = 0.005;

/// Engage and sweep, with one thing broken.
session::SessionSetup story(const session::ScheduledFault& fault, double sweep_s) {
  session::SessionSetup setup = session_setup("bus_faults", 1);
  sim::Phase sweep = phase_named(setup.scenario, "warm_up");
  sweep.duration_s = sweep_s;
  setup.scenario.phases = {phase_named(setup.scenario, "engage"), sweep};
  setup.scenario.phase_names = {"engage", "moving"};
  setup.scenario.faults = {fault};
  setup.scenario.duration_s = 30;
  return setup;
}

bool drives(const CanFrame& frame) {
  const bool set_point = frame.id >= kFirstSetPoint && frame.id <= kLastSetPoint;
  return set_point && (frame.data[2] != 0 || frame.data[3] != 0);
}

TEST(WrongIdentity, IsNeverEngagedHoweverOftenTheOperatorTries) {
  session::SessionSetup setup = story({FaultKind::kWrongIdentity, 0, 0, 3600, 0x10}, 1);
  setup.scenario.duration_s = 12;
  const FinishedSession session = run_session(setup);
  ASSERT_FALSE(session.record.faults.empty());
  EXPECT_EQ(session.record.faults[0].reason.code, ReasonCode::kNodeIdentity);
  EXPECT_EQ(session.record.faults[0].reason.subject, 0x10);
  EXPECT_TRUE(std::none_of(session.record.samples.begin(), session.record.samples.end(), [](const session::Sample& s) {
    return s.machine.mode == Mode::kAligning || s.machine.mode == Mode::kEngaged || s.machine.mode == Mode::kHold;
  }));
  EXPECT_TRUE(
      std::none_of(session.frames.begin(), session.frames.end(), [](const TimedFrame& f) { return drives(f.frame); }));
}

TEST(WrongIdentity, MendedAndTheOperatorHavingLetGoTheMachineIsEngaged) {
  const FinishedSession session = run_session(story({FaultKind::kWrongIdentity, 0, 0, 4, 0x10}, 1));
  ASSERT_EQ(session.record.faults.size(), 1U);
  EXPECT_EQ(session.record.phases_timed_out, 0);
  EXPECT_TRUE(
      std::any_of(session.frames.begin(), session.frames.end(), [](const TimedFrame& f) { return drives(f.frame); }));
}

/// What the bus carried, and how long after the step that sent them its frames were through.
struct Traffic {
  double load = 0;  ///< As the virtual bus carries frames: with every stuff bit that is possible.
  double sync_s = 0, set_points_s = 0;
};

Traffic traffic(const session::FrameLog& frames, double from_s, double until_s, double bit_rate) {
  Traffic traffic;
  int syncs = 0, set_points = 0;
  for (const TimedFrame& f : frames) {
    const double at_s = to_seconds(f.at);
    if (at_s < from_s || at_s >= until_s) continue;
    const double late_s = std::fmod(at_s, kStep_s);
    traffic.load += worst_case_bits(f.frame.size) / (bit_rate * (until_s - from_s));
    if (f.frame.id == kSync) ++syncs, traffic.sync_s += late_s;
    if (f.frame.id >= kFirstSetPoint && f.frame.id <= kLastSetPoint) ++set_points, traffic.set_points_s += late_s;
  }
  traffic.sync_s /= syncs;
  traffic.set_points_s /= set_points;
  return traffic;
}

TEST(Babble, KeepsEverybodyWaitingAndTheMachineGoesOn) {
  constexpr double kAfter_s = 2, kLasts_s = 2;
  const session::SessionSetup setup = story({FaultKind::kBabble, 1, kAfter_s, kLasts_s, 0}, 6);
  const FinishedSession session = run_session(setup);
  const auto first = std::find_if(session.frames.begin(), session.frames.end(),
                                  [](const TimedFrame& f) { return f.frame.id == kBabbled; });
  ASSERT_NE(first, session.frames.end());
  const double from_s = to_seconds(first->at);
  const Traffic before = traffic(session.frames, from_s - 1, from_s, setup.machine.bus.bit_rate);
  const Traffic babbled = traffic(session.frames, from_s, from_s + kLasts_s, setup.machine.bus.bit_rate);
  EXPECT_LT(before.load, 0.6);
  EXPECT_NEAR(babbled.load, 0.95, 0.02);
  EXPECT_GT(babbled.sync_s, before.sync_s + 200e-6) << "a frame of higher priority goes first";
  EXPECT_GT(babbled.set_points_s, before.set_points_s + 600e-6) << "three frames behind one another";
  EXPECT_TRUE(session.record.faults.empty());
  EXPECT_EQ(session.record.phases_timed_out, 0);
  EXPECT_TRUE(std::any_of(session.frames.begin(), session.frames.end(), [&](const TimedFrame& f) {
    return to_seconds(f.at) > from_s + 1 && drives(f.frame);
  })) << "the machine goes on";
}

}  // namespace
}  // namespace knuckle::test
