// What the console shows of a machine it does not hear, or of a loop that stands still: nothing old passes for new.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "app/console/screens/console_data.h"
#include "app/console/screens/screens.h"
#include "app/console/widgets/plots.h"
#include "app/console/window/console_program.h"
#include "tests/console/far_rig.h"
#include "tests/console/window/canned_console.h"
#include "tests/support/says.h"

namespace knuckle::console::window {
namespace {

using test::says;

ConsoleView unheard_view() {
  ConsoleView view = canned_view();
  view.link.silence_s = 1.24;
  return view;
}

TEST(BannerReason, TellsOfSilenceAlsoWhileStopIsPressedAndOfAMachinesSideThatHasEnded) {
  ConsoleView view = unheard_view();
  const auto reason = [&view](bool stop) { return screens::banner_reason(view, stop, 0); };
  EXPECT_TRUE(says(reason(false), "nothing received from the machine for 1.2 s"));
  for (const char* words : {"Stop is pressed", "nothing received from the machine for 1.2 s", "E-stop"})
    EXPECT_TRUE(says(reason(true), words));
  view.hand.enable = false;
  EXPECT_TRUE(says(reason(false), "check the network"));
  view.machine.mode = Mode::kOff;
  EXPECT_TRUE(says(reason(false), "machine's side has ended"));
  EXPECT_FALSE(says(reason(false), "network"));
  view.link.heard = false;
  EXPECT_TRUE(says(reason(false), "another operator"));
  for (const char* words : {"Stop is pressed", "nothing received"}) EXPECT_TRUE(says(reason(true), words));
}

TEST(BannerReason, TakesStopForDoneOnlyWhenTheMachineLeadsNoMore) {
  ConsoleView view = canned_view();
  for (const Mode mode : {Mode::kSelfTest, Mode::kReady, Mode::kAligning, Mode::kEngaged, Mode::kHold}) {
    view.machine.mode = mode;
    EXPECT_TRUE(says(screens::banner_reason(view, true, 0), "not confirmed")) << name(mode);
  }
  view.machine.mode = Mode::kFault;
  view.machine.fault = {ReasonCode::kSensorStale, 0x20, 30, 25};
  EXPECT_FALSE(screens::stopped(view)) << "a fault";
  const std::string other = screens::banner_reason(view, true, 0);
  EXPECT_TRUE(says(other, "stands for another reason") && says(other, text(view.machine.fault))) << other;
  view.machine.fault = {ReasonCode::kOperatorStop, 0, 0, 0};
  EXPECT_TRUE(screens::stopped(view));
  const std::string done = screens::banner_reason(view, true, 0);
  EXPECT_TRUE(says(done, "release it") && says(done, "still presses with 1500 N")) << done;
}

TEST(BannerReason, SaysBesideAnOldCauseWhatThereIsToDoNow) {
  ConsoleView view = canned_view();
  view.machine.contact = false;
  view.machine.mode = Mode::kEStop;
  view.machine.fault = view.machine.blocking = {ReasonCode::kEmergencyStop, 0, 0, 0};
  EXPECT_EQ(screens::banner_reason(view, false, 0), text(view.machine.fault)) << "while the cause is there";
  view.machine.blocking = {ReasonCode::kReleaseToRecover, 0, 0, 0};
  const std::string gone = screens::banner_reason(view, false, 0);
  EXPECT_TRUE(says(gone, text(view.machine.fault)) && says(gone, text(view.machine.blocking))) << gone;
  view.input.release_enable = true;
  view.input.dropped = Dropped::kNoFocus;
  EXPECT_TRUE(says(screens::banner_reason(view, false, 0), "this window had no focus: let go of"));
  view.input = {};
  view.machine.mode = Mode::kFault;
  view.machine.fault = {ReasonCode::kOperatorStop, 0, 0, 0};
  EXPECT_TRUE(says(screens::banner_reason(view, false, 0), "release enable"));
  view.machine.blocking = {ReasonCode::kNoPresence, 0, 0, 0};
  view.hand.enable = false;
  const std::string released = screens::banner_reason(view, false, 0, {HandSource::kKeyboard});
  EXPECT_TRUE(says(released, "now: hold Shift (enable)"));
  EXPECT_FALSE(says(released, "release")) << "of an enable that is not held";
}

TEST(BannerReason, SaysWhatAMachineThatIsNotHeardMayDoWhileEnableIsHeld) {
  ConsoleView view = unheard_view();
  const auto reason = [&view](double silence_s) {
    view.link.silence_s = silence_s;
    return screens::banner_reason(view, false, 0);
  };
  for (const Mode mode : {Mode::kReady, Mode::kAligning, Mode::kEngaged, Mode::kHold}) {
    view.machine.mode = mode;
    EXPECT_TRUE(says(reason(0.3), "the machine may still follow for 0.5 s and may go on when the link returns: let go"))
        << name(mode);
    EXPECT_TRUE(says(reason(0.7), "the machine no longer follows, but may go on when the link returns: let go"))
        << name(mode);
  }
  view.led_by_scenario = true;
  EXPECT_TRUE(says(reason(0.3), "press Stop"));
  view.led_by_scenario = false;
  view.hand.enable = false;
  EXPECT_TRUE(says(reason(0.3), "check the network") && !says(reason(0.3), "follow")) << "enable was let go";
  view.hand.enable = true;
  for (const Mode mode : {Mode::kSelfTest, Mode::kFault, Mode::kEStop}) {
    view.machine.mode = mode;
    EXPECT_FALSE(says(reason(0.3), "follow")) << name(mode) << ": nothing is led before enable was released";
  }
}

/// The same words against a machine that runs, and hears, but is not heard.
TEST(BannerReason, IsTrueOfAMachineWhoseMessagesAloneAreLost) {
  test::FarRig rig;
  rig.engage();
  rig.keys.boom_up = true;
  rig.run(1s);
  rig.network.cut_b_to_a(true);
  const Time cut = rig.now;
  Time followed_until = kNever, said_to_follow = kNever, said_to_hold = kNever;
  while (rig.now < cut + 3s) {
    rig.run(1ms);
    const bool led = !rig.far.side.slave.commands().isZero();
    if (led) followed_until = rig.now;
    const std::string reason = screens::banner_reason(rig.view, false, 0, {HandSource::kKeyboard});
    if (said_to_follow == kNever && says(reason, "may still follow for 0.5 s")) said_to_follow = rig.now;
    if (said_to_hold == kNever && says(reason, "no longer follows")) said_to_hold = rig.now;
    ASSERT_FALSE(led && said_to_hold != kNever) << to_seconds(rig.now - cut);
  }
  EXPECT_LT(said_to_follow, cut + 300ms);
  EXPECT_GT(followed_until, cut + 350ms) << "it does follow";
  EXPECT_LT(followed_until, cut + 550ms);
  EXPECT_GT(said_to_hold, followed_until);
  EXPECT_EQ(rig.far.side.slave.mode(), Mode::kHold);
  rig.keys.boom_up = false;
  rig.network.cut_b_to_a(false);
  rig.run(5s);
  EXPECT_EQ(rig.far.side.slave.mode(), Mode::kEngaged) << "it goes on: " << text(rig.far.side.slave.blocking());
}

TEST(BannerReason, NamesItsOwnPauseAsTheCauseOfWhatGrewOldByIt) {
  ConsoleView view = canned_view();
  view.machine.mode = Mode::kFault;
  view.machine.blocking = {ReasonCode::kReleaseToRecover, 0, 0, 0};
  view.input.own_pause_s = 0.026;
  for (const ReasonCode code : {ReasonCode::kDeviceStale, ReasonCode::kLinkLost}) {
    view.machine.fault = {code, 0, 26, 20};
    const std::string own = screens::banner_reason(view, false, 0);
    EXPECT_TRUE(says(own, "this console itself did not run for 26 ms")) << own;
    EXPECT_FALSE(says(own, text(view.machine.fault))) << own;
    EXPECT_TRUE(says(own, text(view.machine.blocking))) << own;
  }
  view.machine.fault = {ReasonCode::kSensorStale, 0x11, 26, 20};
  EXPECT_TRUE(says(screens::banner_reason(view, false, 0), text(view.machine.fault))) << "not of its making";
}

/// In every way in which enable may have been dropped while it is held.
TEST(BannerReason, SaysToLetGoAndPressAgainWhereverEnableWasDropped) {
  const std::array<std::pair<HandSource, std::string>, 3> hands{
      {{HandSource::kKeyboard, "let go of Shift (enable), then press it again"},
       {HandSource::kGamepad, "let go of the right bumper (enable), then press it again"},
       {HandSource::kDevice, "let go of enable, then press it again"}}};
  ConsoleView view = canned_view();
  view.machine.mode = Mode::kReady;
  view.machine.contact = false;
  view.machine.blocking = {ReasonCode::kNoPresence};
  for (const auto& [hand, words] : hands) {
    const std::string waiting = screens::banner_reason(view, false, 0, {hand});
    EXPECT_FALSE(says(waiting, "let go")) << waiting;
    for (const auto dropped : {Dropped::kNoFocus, Dropped::kTooSmall, Dropped::kStalled, Dropped::kNewStart}) {
      for (const bool known : {false, true}) {
        view.input = {.release_enable = known, .dropped = dropped};
        const std::string reason = screens::banner_reason(view, false, 0, {hand});
        EXPECT_TRUE(says(reason, words)) << reason;
        EXPECT_FALSE(says(reason, "hold ")) << reason;
        EXPECT_EQ(says(reason, "focus"), dropped == Dropped::kNoFocus) << reason;
      }
    }
    view.input = {.release_enable = true};  // held since before this window counted
    EXPECT_TRUE(says(screens::banner_reason(view, false, 0, {hand}), words));
    view.input = {};
    for (const screens::AtWindow& person : {screens::AtWindow{.hand = hand, .enable_ignored = true},
                                            screens::AtWindow{.hand = hand, .pad_ignored = true}}) {
      const std::string reason = screens::banner_reason(view, false, 0, person);
      EXPECT_TRUE(says(reason, words)) << reason;
      EXPECT_FALSE(says(reason, "disconnected")) << "it may have been held since before the window opened";
    }
  }
  const std::string pull =
      screens::banner_reason(view, false, 0, {.hand = HandSource::kKeyboard, .pull_ignored = true});
  EXPECT_TRUE(says(pull, "let go of the mouse button, then press it again")) << pull;
  // Where something else is to be done first, that is said.
  view.input.dropped = Dropped::kNoFocus;
  view.machine.mode = Mode::kEStop;
  view.machine.fault = view.machine.blocking = {ReasonCode::kEmergencyStop, 0, 0, 0};
  EXPECT_EQ(screens::banner_reason(view, false, 0), text(view.machine.fault));
}

TEST(BannerReason, TellsOfALoopThatStandsStillInsteadOfTheLastReason) {
  for (const bool stop : {false, true}) {
    for (const ConsoleView& view : {canned_view(), unheard_view()}) {
      const std::string reason = screens::banner_reason(view, stop, 3.1);
      EXPECT_TRUE(says(reason, "own loop has not run for 3.1 s")) << reason;
      EXPECT_EQ(says(reason, "Stop is pressed"), stop) << reason;
    }
  }
  EXPECT_EQ(screens::banner_reason(canned_view(), false, 0.05),
            "the machine follows the hand; letting go of enable stops it");
}

/// The arm pushes out with 220 bar; the bucket is at its end and its oil shut in.
JointLoads pressing_arm() {
  JointLoads loads;
  loads[kArm] = {
      .pushes = 1, .beyond_Nm = 9000, .reach_m = 1.5, .pressure_Pa = 219.6e5, .at_relief = true, .lasts = true};
  loads[kBucket] = {
      .end = -1, .at_steel = -1, .pushes = -1, .beyond_Nm = 700, .reach_m = 0.5, .pressure_Pa = 205e5, .lasts = true};
  return loads;
}

TEST(BannerReason, SaysThatAMachineThatNobodyLeadsStillPushesThoughItsForceIsNotKnown) {
  ConsoleView view = canned_view();
  view.machine.blocking = {ReasonCode::kEnableNotPressed, 0, 0, 0};
  view.machine.tip_force_N = {-790, 60};
  for (const Mode mode : {Mode::kReady, Mode::kFault, Mode::kEStop}) {
    view.machine.mode = mode;
    view.machine.confidence = 1;
    EXPECT_TRUE(says(screens::banner_reason(view, false, 0), "the bucket still presses with 800 N")) << name(mode);
    view.machine.confidence = 0.03;
    EXPECT_TRUE(says(screens::banner_reason(view, false, 0, {}, pressing_arm()),
                     "still pressing: arm 220 bar; oil shut in, bucket 205 bar"));
    EXPECT_FALSE(says(screens::banner_reason(view, false, 0), "presses")) << "a force that is not known";
  }
  view.machine.confidence = 1;
  view.machine.contact = false;
  EXPECT_FALSE(says(screens::banner_reason(view, false, 0), "presses")) << "its own weight";
  view.machine.contact = true;
  view.machine.mode = Mode::kEngaged;
  EXPECT_FALSE(says(screens::banner_reason(view, false, 0), "presses")) << "somebody presses on purpose";
}

TEST(BannerReason, SaysOfAMachineThatIsLedWhyItDoesNotMoveAndWhatIsNotFelt) {
  ConsoleView view = canned_view();
  const auto reason = [&](const JointLoads& loads) { return screens::banner_reason(view, false, 0, {}, loads); };
  EXPECT_TRUE(says(reason(pressing_arm()), "bucket in (curl): at its end, move it the other way"));
  EXPECT_FALSE(says(reason(pressing_arm()), "cannot be measured")) << "it is";
  view.machine.confidence = 0.9;
  view.hand.warning = {ReasonCode::kEnergyWatchdog, 0, 0.04F, 0.03F};
  EXPECT_TRUE(says(reason({}), text(view.hand.warning))) << reason({});
  view.hand.warning = {};
  view.machine.confidence = 0.07;
  EXPECT_TRUE(says(reason(pressing_arm()), "pressing hard; cannot be measured: arm at relief"));
  EXPECT_TRUE(says(reason({}), "force is not known (confidence 7 %)")) << reason({});
  view.machine.blocking = {ReasonCode::kPowerLimit, 0, 9.1F, 9};
  EXPECT_TRUE(says(reason(pressing_arm()), text(view.machine.blocking)) && says(reason(pressing_arm()), "at its end"));
  view.machine.mode = Mode::kReady;
  EXPECT_FALSE(says(reason({}), "confidence")) << "nothing is felt of a machine that is not led";
}

TEST(BannerReason, TellsOfAPieceForSomeSeconds) {
  using Kind = sim::WorldEventKind;
  for (const auto& [kind, words] :
       {std::pair{Kind::kPieceBroke, "a piece broke off"}, std::pair{Kind::kPieceDown, "a piece fell to the ground"}}) {
    ConsoleView view = canned_view();
    view.truth.events.push({kind, 0, view.simulated_s - 1, 820});
    EXPECT_EQ(screens::banner_reason(view, false, 0),
              std::string(words) + "; the machine follows the hand; letting go of enable stops it");
    view.simulated_s += 9;
    EXPECT_FALSE(says(screens::banner_reason(view, false, 0), "piece"));
  }
}

TEST(BannerReason, SaysWhatToDoWithTheInputInUse) {
  ConsoleView view = canned_view();
  view.machine.mode = Mode::kReady;
  view.machine.contact = false;
  for (const ReasonCode code : {ReasonCode::kNoPresence, ReasonCode::kEnableNotPressed}) {
    view.machine.blocking = {code};
    view.led_by_scenario = false;
    EXPECT_TRUE(says(screens::banner_reason(view, false, 0, {HandSource::kKeyboard}), "hold Shift"));
    EXPECT_TRUE(says(screens::banner_reason(view, false, 0, {HandSource::kGamepad}), "hold the right bumper"));
    EXPECT_EQ(screens::banner_reason(view, false, 0, {HandSource::kDevice}), text(view.machine.blocking));
    view.led_by_scenario = true;
    EXPECT_TRUE(says(screens::banner_reason(view, false, 0, {HandSource::kKeyboard}), "scenario"));
  }
  view.led_by_scenario = false;
  screens::AtWindow person{HandSource::kKeyboard, true, true};
  EXPECT_TRUE(says(screens::banner_reason(view, false, 0, person), "while a text field is active"));
  person.typing = false;
  EXPECT_TRUE(says(screens::banner_reason(view, false, 0, person), "let go of Shift"));
  view.machine = {};
  view.input.unattended = true;
  EXPECT_TRUE(says(screens::banner_reason(view, false, 0), "click into it"));
  EXPECT_TRUE(test::begins(screens::banner_reason(view, true, 0), "Stop")) << "Stop comes first";
}

TEST(BannerReason, SaysHowAPausedSessionGoesOnAndStopBeforeThat) {
  ConsoleView view = canned_view();
  view.paused = true;
  for (const Mode mode : {Mode::kReady, Mode::kEngaged, Mode::kFault}) {
    view.machine.mode = mode;
    EXPECT_EQ(screens::banner_reason(view, false, 0), "paused: press P to resume") << name(mode);
    EXPECT_EQ(screens::banner_reason(view, true, 0).rfind("Stop is pressed", 0), 0U) << name(mode);
  }
  view.machine.mode = Mode::kEngaged;
  EXPECT_TRUE(says(screens::banner_reason(view, true, 0), "press P"))
      << "no machine confirms anything while its time stands";
}

TEST(Freshness, IsNoneOfMuteSensorsThoughTheMachinesSideGoesOnSending) {
  ConsoleView view = canned_view();
  view.machine.stamp.sent_at = Time(10s);
  view.machine.sensor_at = Time(10s) - 8ms;
  EXPECT_FALSE(screens::measured_freshness(view).stale());
  view.machine.sensor_at = Time(10s) - 300ms;
  EXPECT_TRUE(screens::measured_freshness(view).stale());
  EXPECT_FALSE(screens::machine_freshness(view).stale());
  view.machine.sensor_at = kNever;
  EXPECT_FALSE(screens::measured_freshness(view).heard);
  const Freshness fresh{.heard = true, .age_s = 0.1, .limit_s = 0.25};  // grows old with the loop's view
  EXPECT_FALSE(fresh.after(0.1).stale());
  EXPECT_TRUE(fresh.after(0.2).stale());
}

ConsoleHost host_of(const char* scenario) {
  session::SimulateOptions options;
  options.scenario = scenario;
  return ConsoleHost(options, LiveSession::Led::kByPerson, nullptr, nullptr);
}

TEST(SessionChoice, BeginsWithTheScenariosOwnLinkAndAssist) {
  screens::UiState state;
  show_session(state, host_of("wall_contact"));
  EXPECT_FLOAT_EQ(state.simulation.delay_ms, 10);
  EXPECT_EQ(state.simulation, state.running);
  EXPECT_FALSE(state.assist.stop_on_object);
  state.simulation.scenario = 1;
  show_session(state, host_of("buried_pipe"));
  EXPECT_FLOAT_EQ(state.simulation.delay_ms, 1);
  EXPECT_TRUE(state.assist.stop_on_object);
  state.assist.stop_on_object = false;  // the person's, from now on
  show_session(state, host_of("buried_pipe"));
  EXPECT_FALSE(state.assist.stop_on_object);
}

TEST(SessionChoice, LeavesTheLinkToScenarioAndCommandLineUntilThePersonMovesASlider) {
  screens::SimulationChoice choice;
  choice.scenario = 1;
  choice.delay_ms = 30;
  choice.loss_percent = 2;
  session::SimulateOptions asked;
  EXPECT_FALSE(next_session(asked, choice, canned_facts()).delay_ms);
  EXPECT_EQ(next_session(asked, choice, canned_facts()).scenario, "wall_contact");
  asked.delay_ms = 5;
  EXPECT_EQ(next_session(asked, choice, canned_facts()).delay_ms, 5);
  choice.link_chosen = true;
  EXPECT_EQ(next_session(asked, choice, canned_facts()).delay_ms, 30);
  EXPECT_DOUBLE_EQ(next_session(asked, choice, canned_facts()).loss.value_or(0), 0.02);
  choice.jitter_ms = 100;
  EXPECT_EQ(next_session(asked, choice, canned_facts()).jitter_ms, 30) << "no delay is below 0";
}

TEST(ConfidenceText, AreThoseOfTheMachinesSideAndNotGuessedAt) {
  ConsoleView view = canned_view();
  EXPECT_EQ(screens::confidence_text(view),
            "at rest: friction hides small forces, still learning this machine's free motion");
  view.status.force_doubts = 0;
  EXPECT_EQ(screens::confidence_text(view), "no known disturbance");
  std::string before;
  for (unsigned bit = 1; bit < 1U << estimation::kConfidenceReasons; bit <<= 1) {
    view.status.force_doubts = static_cast<std::uint16_t>(bit);
    EXPECT_NE(screens::confidence_text(view), before) << bit;
    before = screens::confidence_text(view);
  }
  view.status_age_s = 3;
  EXPECT_EQ(screens::confidence_text(view), "the machine reports no cause");
}

class HistoryOfSixtyFrames : public testing::Test {
 protected:
  /// One second of frames, 60 each.
  void run(bool machine_known, bool status_known) {
    for (int i = 0; i < 60; ++i) {
      view_.now += 16'666'667ns;
      history_.watch(view_, machine_known, status_known);
    }
  }
  /// How many of the newest second's samples are known.
  template <typename Value>
  int known(const Value& value) const {
    int n = 0;
    for (std::size_t i = 0; i < 20; ++i) n += std::isfinite(value(history_.ago(i))) ? 1 : 0;
    return n;
  }
  static double command(const History::Sample& s) { return s.status.valve_command[kArm]; }
  static double speed(const History::Sample& s) { return s.machine.velocity_radps[kArm]; }
  static double energy(const History::Sample& s) { return s.hand_energy_J; }

  ConsoleView view_ = canned_view();
  History history_;
};

TEST_F(HistoryOfSixtyFrames, HasTwentySamplesASecondAndKnowsNothingOfAMachineThatIsNotHeard) {
  run(true, true);
  EXPECT_NEAR(static_cast<double>(history_.size()), 20, 1);
  EXPECT_DOUBLE_EQ(command(history_.ago(0)), -0.62);
  EXPECT_EQ(known(command), 20);
  EXPECT_EQ(known(speed), 20);
  run(false, true);
  EXPECT_EQ(known(speed), 0);
  EXPECT_EQ(known(command), 20);
  run(true, false);
  EXPECT_EQ(known(speed), 20);
  EXPECT_EQ(known(command), 0);
  EXPECT_EQ(known(energy), 20) << "the hand is on this side";
}

TEST_F(HistoryOfSixtyFrames, LeavesOpenWhatNobodyLookedAtAndBeginsAnewWithTheSession) {
  run(true, true);
  view_.now += 500ms;
  history_.watch(view_, true, true);
  EXPECT_EQ(known(energy), 20 - 9) << "half a second without a view, but its last step";
  view_.now += 150ms;
  history_.watch(view_, true, true);
  EXPECT_EQ(known(energy), 20 - 9) << "a window that draws slowly holds its values";
  view_.now = Time(50ms);
  history_.watch(view_, true, true);
  EXPECT_EQ(history_.size(), 1U);
}

TEST(PayloadKnown, OnlyToAThirdOrToATwentiethOfAFullBucket) {
  constexpr double kFull_kg = 150;
  const auto known = [](double kg, double sigma_kg) {
    SlaveMessage machine;
    machine.payload_kg = kg;
    machine.payload_sigma_kg = sigma_kg;
    return screens::payload_is_known(machine, kFull_kg);
  };
  EXPECT_TRUE(known(44.6, 2.3));
  EXPECT_TRUE(known(-0.4, 2.3)) << "an empty bucket";
  EXPECT_FALSE(known(0, 300)) << "nothing learnt yet";
  EXPECT_FALSE(known(312, 1070)) << "pressed against a wall";
  EXPECT_FALSE(known(412, 243)) << "an empty bucket that the arm presses into a wall, the boom pushed to its end";
  EXPECT_FALSE(known(23, 8));
  EXPECT_TRUE(known(25, 8));
  EXPECT_TRUE(known(5, 7));
}

class Payload : public testing::Test {
 protected:
  void carry(double kg, double sigma_kg, Duration time) {
    machine_.payload_kg = kg;
    machine_.payload_sigma_kg = sigma_kg;
    for (const Time end = now_ + time; now_ < end; now_ += 100ms) total_.watch(machine_, now_);
  }
  screens::PayloadTotal total_{10};
  SlaveMessage machine_;
  Time now_{};
};

TEST_F(Payload, CountsEachLoadOnceWhenItIsLetGoAsItWasKnownBest) {
  carry(0, 2, 3s);
  carry(60, 0.5, 300ms);  // a spike: no load, nor part of a later one
  carry(0, 2, 3s);
  carry(38, 4, 1s);
  carry(40, 1.5, 3s);
  carry(43, 3, 1s);
  EXPECT_EQ(total_.loads(), 0);
  carry(0, 2, 4s);
  EXPECT_EQ(total_.loads(), 1);
  EXPECT_DOUBLE_EQ(total_.total_kg(), 40);
  carry(25, 2, 3s);
  carry(0, 200, 3s);  // the machine's side weighs anew: not two loads
  carry(25, 2, 3s);
  carry(0, 2, 3s);
  EXPECT_EQ(total_.loads(), 2);
  EXPECT_DOUBLE_EQ(total_.total_kg(), 65);
}

TEST_F(Payload, BooksNothingForTimeInWhichNothingWasHeard) {
  carry(40, 2, 300ms);
  now_ += 5s;
  carry(40, 2, 300ms);
  now_ += 5s;
  carry(0, 2, 3s);
  EXPECT_EQ(total_.loads(), 0) << "seen for no second on end";
  carry(40, 2, 3s);
  now_ += 5s;
  carry(0, 2, 300ms);
  EXPECT_EQ(total_.loads(), 0) << "an estimate that is light for a moment";
  carry(0, 2, 1s);
  EXPECT_EQ(total_.loads(), 1);
}

}  // namespace
}  // namespace knuckle::console::window
