// What a person at the console can rely on: the machine follows the keys, and stops whenever it must.
#include "app/console/console_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/console/console_rig.h"
#include "tests/support/no_alloc.h"

namespace knuckle::test {
namespace {

using console::ConsoleEventKind;

TEST(ConsoleKeys, LeadEachJointOfTheSimulatedMachineTheWayTheyPoint) {
  ConsoleRig rig;
  rig.start_up();
  ASSERT_TRUE(rig.engage());
  const std::pair<bool console::HeldKeys::*, bool console::HeldKeys::*> kPairs[]{
      {&console::HeldKeys::boom_up, &console::HeldKeys::boom_down},
      {&console::HeldKeys::arm_out, &console::HeldKeys::arm_in},
      {&console::HeldKeys::bucket_out, &console::HeldKeys::bucket_in}};
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    const auto row = Eigen::Index(joint);
    const auto [positive, negative] = kPairs[joint];
    for (const auto key : {positive, negative}) {
      const JointVector before = rig.view.machine.position_rad;
      rig.keys.*key = true;
      rig.run(1);
      rig.keys.*key = false;
      rig.run(0.5);
      JointVector moved = rig.view.machine.position_rad - before;
      const double asked = (key == positive ? 1 : -1) * console::kFullRate_radps[row];
      EXPECT_NEAR(moved[row], asked, 0.25 * std::abs(asked)) << kJointNames[joint];
      moved[row] = 0;
      EXPECT_LT(moved.cwiseAbs().maxCoeff(), 0.04) << kJointNames[joint] << " moves another";
    }
  }
  EXPECT_EQ(rig.view.machine.mode, Mode::kEngaged);
}

TEST(ConsoleKeys, WithoutEnableNothingMovesWhateverIsHeld) {
  ConsoleRig rig;
  rig.start_up();
  const JointVector before = rig.view.machine.position_rad;
  rig.keys.boom_up = rig.keys.arm_out = true;
  rig.run(2);
  EXPECT_LT((rig.view.machine.position_rad - before).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_EQ(session::commands_not_neutral(rig.frames, rig.setup.machine, Time{}, rig.now), 0);
}

TEST(ConsoleKeys, LettingGoOfEnableIsNeutralOnTheWire) {
  ConsoleRig rig;
  lead(rig);
  rig.keys = {};
  const Time released = rig.now;
  rig.run(1);
  expect_neutral_within(rig, released, 200ms);
  EXPECT_EQ(rig.view.machine.mode, Mode::kReady);  // no fault
}

TEST(ConsoleStop, IsNeutralOnTheWireWithin200MillisecondsAlsoWhereTheWindowCountsForNothingElse) {
  struct Case {
    const char* name;
    bool attended, too_small;
  };
  // Nobody attends it: Stop may be a gamepad's button.
  for (const Case& window :
       {Case{"in front", true, false}, Case{"nobody attends", false, false}, Case{"too small", true, true}}) {
    SCOPED_TRACE(window.name);
    ConsoleRig rig;
    lead(rig);
    rig.attended = window.attended;
    rig.input.too_small = window.too_small;
    rig.input.stop = true;
    const Time pressed = rig.now;
    rig.run(1);
    expect_neutral_within(rig, pressed, 200ms);
    EXPECT_EQ(rig.view.machine.mode, Mode::kFault);
    EXPECT_EQ(rig.view.machine.fault.code, ReasonCode::kOperatorStop);
    EXPECT_TRUE(told(rig, ConsoleEventKind::kStop, true));
  }
}

TEST(ConsoleStop, ReleasedDoesNotResumeBeforeEnableWasLetGoOf) {
  ConsoleRig rig;
  lead(rig);
  rig.input.stop = true;
  rig.run(0.5);
  rig.input.stop = false;
  const Time released = rig.now;
  rig.run(3);
  EXPECT_EQ(session::commands_not_neutral(rig.frames, rig.setup.machine, released, rig.now), 0);
  EXPECT_EQ(rig.view.machine.mode, Mode::kFault);
  rig.keys = {};
  rig.run(0.3);
  EXPECT_TRUE(rig.engage()) << text(rig.view.machine.blocking);
}

TEST(ConsoleStop, NeedsNoHapticDevice) {
  class Unplugged final : public HidPort {
    bool write(const HidReport& /*report*/) noexcept override { return false; }
    bool read(HidReport& /*report*/) noexcept override { return false; }
    [[nodiscard]] bool connected() const noexcept override { return false; }
  } unplugged;
  const session::SessionSetup setup = live_setup();
  console::ConsoleLoop loop(
      std::make_unique<console::LiveSession>(setup, console::LiveSession::Led::kByPerson, &unplugged));
  console::ConsoleInput input;
  console::ConsoleView view;
  for (Time now{1ms}; now < Time(4s); now += 1ms) {
    input.at = now;
    input.stop = now > Time(3s);
    loop.put(input);
    loop.step(now);
    loop.take(view);
    if (now == Time(3s)) {
      ASSERT_EQ(view.machine.mode, Mode::kReady);
    }
  }
  EXPECT_EQ(view.machine.mode, Mode::kFault);
  EXPECT_EQ(view.machine.fault.code, ReasonCode::kOperatorStop);
  EXPECT_EQ(view.hand.device.code, ReasonCode::kDeviceLost);
}

TEST(ConsolePause, TimeStandsAndGoesOnWhereItStood) {
  ConsoleRig rig;
  rig.start_up();
  rig.input.paused = true;
  rig.run(0.1);
  const console::ConsoleView stood = rig.view;
  rig.run(2);
  EXPECT_TRUE(rig.view.paused);
  EXPECT_EQ(rig.view.now, stood.now);
  EXPECT_EQ(rig.view.machine.position_rad, stood.machine.position_rad);
  rig.input.paused = false;
  rig.run(1);
  EXPECT_NEAR(to_seconds(rig.view.now - stood.now), 1, 0.03);
  EXPECT_NE(rig.view.machine.mode, Mode::kFault);
}

TEST(ConsoleScales, AreTakenBeforeAndLockedWhileTheMachineIsLed) {
  ConsoleRig rig;
  rig.start_up();
  rig.input.position_scale = 8;
  rig.input.force_scale = 1.0 / 2000;
  rig.run(0.1);
  EXPECT_DOUBLE_EQ(rig.view.hand.position_scale, 8);
  EXPECT_DOUBLE_EQ(rig.view.hand.force_scale, 1.0 / 2000);
  ASSERT_TRUE(rig.engage()) << text(rig.view.machine.blocking);
  rig.input.position_scale = 5;
  rig.run(0.5);
  EXPECT_DOUBLE_EQ(rig.view.hand.position_scale, 8);
  const auto refusals = std::count_if(rig.events.begin(), rig.events.end(), [](const console::ConsoleEvent& e) {
    return e.kind == ConsoleEventKind::kScales && !e.on;
  });
  EXPECT_EQ(refusals, 1);
  rig.keys = {};
  rig.run(0.5);
  EXPECT_DOUBLE_EQ(rig.view.hand.position_scale, 5);
}

TEST(ConsoleScales, BeyondTheirBoundsAreTakenAsTheBound) {
  ConsoleRig rig;
  rig.input.position_scale = 1e6;
  rig.input.force_scale = 1e-9;
  rig.run(0.1);
  EXPECT_DOUBLE_EQ(rig.view.hand.position_scale, console::kMostPositionScale);
  EXPECT_DOUBLE_EQ(rig.view.hand.force_scale, console::kLeastForceScale);
  rig.input.force_scale = 1;  // with the most position it would make the spring four times the device file's
  rig.run(0.1);
  const auto& feel = rig.setup.device.feel;
  EXPECT_NEAR(rig.view.hand.position_scale * rig.view.hand.force_scale / (feel.position_scale * feel.force_scale),
              master::MasterLoop::kStiffest, 1e-9);
  rig.input.position_scale = rig.input.force_scale = 0;
  rig.run(0.1);
  EXPECT_DOUBLE_EQ(rig.view.hand.position_scale, rig.setup.device.feel.position_scale);
}

TEST(ConsoleReset, BeginsAnewAndNeutralWhateverIsHeld) {
  ConsoleRig rig;
  lead(rig);
  rig.loop.offer(live_session(rig.setup));
  const Time reset = rig.now;
  rig.run(6);  // past the new machine's start-up, keys still held
  EXPECT_EQ(rig.view.run, 2u);
  EXPECT_NEAR(rig.view.simulated_s, 6, 0.1);
  EXPECT_TRUE(told(rig, ConsoleEventKind::kNewStart, true));
  EXPECT_TRUE(
      std::is_sorted(rig.frames.begin(), rig.frames.end(), [](const auto& a, const auto& b) { return a.at < b.at; }));
  EXPECT_EQ(session::commands_not_neutral(rig.frames, rig.setup.machine, reset, rig.now), 0);
  EXPECT_EQ(rig.view.machine.mode, Mode::kReady);
}

TEST(ConsoleDemo, GoesOnAndHasNothingToSayWhenNobodyAttendsOrTheWindowStalls) {
  ConsoleRig rig(live_setup("wall_contact", 3), console::LiveSession::Led::kByScenario);
  rig.run(8);
  rig.attended = false;
  rig.run(1);
  rig.stalled = true;
  rig.run(2);
  rig.stalled = false;
  rig.run(1);
  EXPECT_EQ(rig.view.machine.mode, Mode::kEngaged);
  EXPECT_FALSE(rig.view.input.unattended || rig.view.input.release_enable);
  for (const bool on : {true, false}) {
    EXPECT_FALSE(told(rig, ConsoleEventKind::kInput, on));
    EXPECT_FALSE(told(rig, ConsoleEventKind::kAttended, on));
  }
}

TEST(ConsoleDemo, IsTheVerySessionThatSimulateRuns) {
  const session::SessionSetup setup = live_setup("wall_contact", 2);
  session::Session session(setup);
  for (int i = 0; i < 8000; ++i) session.step();
  const session::FrameLog frames = session.take_outcome().frames;
  ConsoleRig rig(setup, console::LiveSession::Led::kByScenario);
  rig.run(8);
  ASSERT_EQ(rig.frames.size(), frames.size());
  for (std::size_t i = 0; i < rig.frames.size(); ++i) {
    ASSERT_EQ(rig.frames[i].at, frames[i].at) << i;
    ASSERT_EQ(rig.frames[i].frame.id, frames[i].frame.id) << i;
    ASSERT_EQ(rig.frames[i].frame.data, frames[i].frame.data) << i;
  }
}

TEST(ConsoleStep, AllocatesNothingWhateverThePersonDoes) {
  ConsoleRig rig;
  rig.start_up();
  ASSERT_TRUE(rig.engage());
  auto next = live_session(rig.setup);
  recording::RecorderOptions nowhere;
  nowhere.keep = false;
  recording::Recorder recorder(nowhere, {}, rig.setup.machine);
  next->record_to(recorder);
  rig.input.hand = console::hand_from_keys(rig.keys);
  rig.input.hand.rate_radps = console::kFullRate_radps;
  std::uint64_t allocated = 0;
  for (int i = 0; i < 3000; ++i) {
    rig.now += 1ms;
    rig.input.at = rig.now;
    rig.input.stop = i > 1500;
    rig.input.paused = i > 1700 && i < 1800;
    rig.input.position_scale = i > 2000 ? 7 : 0;
    rig.loop.put(rig.input);
    if (i == 2200) rig.loop.offer(std::move(next));
    const NoAllocScope scope;
    rig.loop.step(rig.now);
    allocated += scope.allocations();
  }
  EXPECT_EQ(allocated, 0u);
}

TEST(ConsoleView, ShowsWhatTheMachineTellsOfItselfAndHowLongTheHandTakesToTheValves) {
  ConsoleRig rig;
  lead(rig);
  EXPECT_TRUE(rig.view.status_heard);
  EXPECT_LT(rig.view.status_age_s, 0.1);
  EXPECT_TRUE(rig.view.status.pilot_on);
  EXPECT_GT(std::abs(rig.view.status.valve_command[kBoom]), 0.05);
  EXPECT_GT(rig.view.status.buses[0].load, 0.05);
  const Histogram& hand_to_valve = rig.view.link.hand_to_valve;
  ASSERT_GT(hand_to_valve.count(), 5u);
  const double link_s = 1e-3 * rig.setup.scenario.delay_ms;
  EXPECT_GE(to_seconds(hand_to_valve.quantile(0.5)), link_s);
  EXPECT_LT(to_seconds(hand_to_valve.quantile(0.5)), link_s + 0.030);
  EXPECT_EQ(rig.view.link.loss, 0);
}

TEST(ConsoleEnd, LetsGoOfMachineAndHand) {
  ConsoleRig rig;
  lead(rig);
  rig.loop.let_go();
  const Time asked = rig.now;
  rig.run(0.3);
  EXPECT_TRUE(rig.loop.has_let_go());
  expect_neutral_within(rig, asked, 200ms);
}

}  // namespace
}  // namespace knuckle::test
