// What is held counts only while a window runs and somebody attends it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/console/console_loop.h"
#include "app/console/operator_station.h"
#include "tests/console/console_rig.h"

namespace knuckle::test {
namespace {

using console::ConsoleEventKind;

/// Enable was held all the while: it counts once it was let go of and is pressed anew.
void expect_has_to_press_again(ConsoleRig& rig, console::Dropped dropped) {
  const Time again = rig.now;
  rig.run(3);
  EXPECT_EQ(session::commands_not_neutral(rig.frames, rig.setup.machine, again, rig.now), 0);
  EXPECT_TRUE(rig.view.input.release_enable);
  EXPECT_EQ(rig.view.input.dropped, dropped);
  rig.keys = {};
  rig.run(0.5);
  EXPECT_FALSE(rig.view.input.release_enable);
  EXPECT_TRUE(rig.engage()) << text(rig.view.machine.blocking);
  EXPECT_EQ(rig.view.input.dropped, console::Dropped::kNo);
}

TEST(ConsoleWindow, ThatStallsIsTooSmallOrThatNobodyAttendsHoldsNothingAndDoesNotResumeByItself) {
  const struct {
    console::Dropped why;
    void (*set)(ConsoleRig& rig, bool away);  // keys stay held: as a gamepad's, which does not care for windows
    Duration noticed;
  } kWays[]{
      {console::Dropped::kStalled, [](ConsoleRig& rig, bool away) { rig.stalled = away; }, console::kInputAgeLimit},
      {console::Dropped::kNoFocus, [](ConsoleRig& rig, bool away) { rig.attended = !away; }, 0ms},
      {console::Dropped::kTooSmall, [](ConsoleRig& rig, bool away) { rig.input.too_small = away; }, 0ms}};
  for (const auto& way : kWays) {
    SCOPED_TRACE(static_cast<int>(way.why));
    ConsoleRig rig;
    lead(rig);
    way.set(rig, true);
    const Time since = rig.now;
    rig.run(2);
    expect_neutral_within(rig, since, way.noticed + 200ms);
    rig.loop.take(rig.view);
    EXPECT_FALSE(rig.view.hand.presence || rig.view.hand.enable);
    EXPECT_EQ(rig.view.machine.mode, Mode::kReady);  // no fault
    EXPECT_EQ(rig.view.input.unattended, !rig.attended);
    EXPECT_EQ(told(rig, ConsoleEventKind::kAttended, false), !rig.attended);
    EXPECT_EQ(told(rig, ConsoleEventKind::kTooSmall, true), rig.input.too_small);
    way.set(rig, false);
    expect_has_to_press_again(rig, way.why);
    EXPECT_FALSE(rig.view.input.unattended);
    EXPECT_TRUE(way.why != console::Dropped::kNoFocus || told(rig, ConsoleEventKind::kAttended, true));
  }
}

/// Somebody with a haptic device in front of the window.
struct DeviceRig {
  session::SessionSetup setup = live_setup();
  session::HandSide device{setup.device, setup.limb, 1, setup.scenario.hand_rad};
  console::PersonHand person{setup.device, setup.machine, setup.limb};
  console::ConsoleLoop loop{
      std::make_unique<console::LiveSession>(setup, console::LiveSession::Led::kByPerson, &device.cable.host())};
  console::ConsoleInput window;
  console::ConsoleView view;
  console::HandInput held;
  Time now{};
  bool stalled = false;

  DeviceRig() { window.attended = true; }
  void run(double seconds) {
    for (const Time until = now + from_seconds(seconds); now < until;) {
      now += 1ms;
      loop.take(view);
      sim::OperatorView seen;
      seen.machine_rad = view.machine.position_rad;
      seen.ghost_rad = view.hand.ghost_rad;
      seen.hand_rad = device.device.truth().joint_rad;
      seen.mode = view.machine.mode;
      device.step(now, person.step(now, held, seen, 1));
      window.at = stalled ? window.at : now;
      loop.put(window);
      loop.step(now);
    }
  }
  void engage() {
    run(3);
    held.presence = held.enable = true;
    run(5);
    ASSERT_EQ(view.machine.mode, Mode::kEngaged) << text(view.machine.blocking);
  }
  /// Enable is held on while nobody is at the window, and after it.
  void expect_has_to_press_again(console::Dropped dropped) {
    EXPECT_EQ(view.machine.mode, Mode::kReady);
    EXPECT_TRUE(view.hand.enable) << "the device still says so";
    stalled = false;
    window.attended = true;
    run(3);
    EXPECT_EQ(view.machine.mode, Mode::kReady);
    EXPECT_TRUE(view.input.release_enable);
    const console::Dropped why = view.input.dropped;
    held.enable = false;
    run(0.3);
    EXPECT_FALSE(view.input.release_enable);
    EXPECT_EQ(view.input.dropped, console::Dropped::kNo);
    EXPECT_EQ(why, dropped);
  }
};

TEST(ConsoleWindow, ThatStallsOrNobodyAttendsLetsNobodyLeadWithAHapticDeviceEither) {
  DeviceRig rig;
  rig.engage();
  rig.stalled = true;
  rig.run(to_seconds(console::kInputAgeLimit) - 0.05);
  EXPECT_EQ(rig.view.machine.mode, Mode::kEngaged);
  rig.run(0.3);
  rig.expect_has_to_press_again(console::Dropped::kStalled);
  DeviceRig alone;
  alone.engage();
  alone.window.attended = false;
  alone.run(0.3);
  alone.expect_has_to_press_again(console::Dropped::kNoFocus);
}

TEST(ConsoleWindow, ThatStallsAMomentTooLongIsNoticedThoughTheLinkMayHaveCarriedNothingOfIt) {
  DeviceRig rig;
  rig.engage();
  rig.stalled = true;
  rig.run(to_seconds(console::kInputAgeLimit) + 0.003);
  rig.stalled = false;
  rig.run(0.5);
  rig.expect_has_to_press_again(console::Dropped::kStalled);
}

/// GLFW lets go of every key when the focus goes, and is not told of one that is held as it comes back.
TEST(ConsoleWindow, WithoutFocusIsNotToldWhetherAKeyIsStillHeldAndSoGoesOnAskingForItsRelease) {
  ConsoleRig rig;
  lead(rig);
  rig.attended = false;
  rig.keys = {};
  rig.run(1);
  EXPECT_EQ(rig.view.input.dropped, console::Dropped::kNo) << "what blocks now is the focus itself";
  rig.attended = true;
  rig.run(1);
  EXPECT_FALSE(rig.view.input.release_enable);
  EXPECT_EQ(rig.view.input.dropped, console::Dropped::kNoFocus);
  EXPECT_TRUE(rig.engage()) << text(rig.view.machine.blocking);
  EXPECT_EQ(rig.view.input.dropped, console::Dropped::kNo);
}

TEST(ConsoleWindow, ThatAsksForNoNumberMovesNothing) {
  ConsoleRig rig;
  rig.start_up();
  ASSERT_TRUE(rig.engage());
  rig.run(1);          // the machine has come to the hand
  rig.stalled = true;  // its frames are put here
  const JointVector before = rig.view.machine.position_rad;
  for (int i = 0; i < 100; ++i) {
    rig.input.at = rig.now;
    rig.input.hand.rate_radps = JointVector(std::nan(""), 0.2, 0.2);
    rig.loop.put(rig.input);
    rig.run(0.01);
  }
  rig.loop.take(rig.view);
  EXPECT_EQ(rig.view.machine.mode, Mode::kEngaged);
  EXPECT_LT((rig.view.machine.position_rad - before).cwiseAbs().maxCoeff(), 0.01);
}

TEST(ConsoleWindow, ThatStallsMissesNoEventOfTheMeantime) {
  ConsoleRig rig;
  lead(rig);
  rig.stalled = true;
  rig.run(3);  // enable falls, mode ready, "no hand" stands
  rig.stalled = false;
  rig.events.clear();
  rig.run(0.1);
  const auto became = [&rig](Mode mode) {
    return std::any_of(rig.events.begin(), rig.events.end(), [mode](const console::ConsoleEvent& e) {
      return e.kind == ConsoleEventKind::kMachine && e.mode == mode;
    });
  };
  EXPECT_TRUE(became(Mode::kReady) || became(Mode::kFault));
  EXPECT_TRUE(told(rig, ConsoleEventKind::kInput, false));
  EXPECT_TRUE(told(rig, ConsoleEventKind::kInput, true));
  EXPECT_EQ(rig.loop.events_lost(), 0u);
}

}  // namespace
}  // namespace knuckle::test
