// What the console says of force, limits and link: nothing that the machine does not know.
#include "app/console/machine_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/console/event_book.h"
#include "app/console/link_watch.h"
#include "machine/load.h"
#include "tests/support/says.h"

namespace knuckle::console {
namespace {

struct TextRig {
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  Kinematics kinematics{machine};
  ConsoleView view;
  bool measured = true;

  TextRig() {
    view.link.heard = true;
    view.machine.confidence = 0.9;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
      view.machine.position_rad[i] = 0.5 * (link.min_rad + link.max_rad);
    }
  }
  [[nodiscard]] std::vector<std::string> limits() const {
    const JointLoads loads = joint_loads(view.machine, machine, kinematics);
    return limit_texts(view, machine, kinematics, loads, measured);
  }
  [[nodiscard]] bool says(const std::string& words) const {
    const auto all = limits();
    return std::find(all.begin(), all.end(), words) != all.end();
  }
};

TEST(ForceText, WithoutConfidenceThereIsNoForceAndNoContact) {
  TextRig rig;
  rig.view.machine.contact = true;
  rig.view.machine.tip_force_N = {2695, 0};
  EXPECT_TRUE(force_text(rig.view).known);
  EXPECT_TRUE(force_text(rig.view).contact);
  rig.view.machine.confidence = kLeastConfidence;
  EXPECT_FALSE(force_text(rig.view).known);
  EXPECT_FALSE(force_text(rig.view).contact);
  EXPECT_STREQ(force_text(rig.view).contact_word, "Not known");
  rig.view.machine.confidence = 1;
  rig.view.link.heard = false;
  EXPECT_FALSE(force_text(rig.view).known);
}

TEST(LimitTexts, NameTheJointAndItsDirectionAndNothingOfAPoseThatIsNotKnown) {
  TextRig rig;
  EXPECT_TRUE(rig.limits().empty());
  rig.view.machine.position_rad[kBucket] = rig.machine.links[kBucket].min_rad;
  EXPECT_TRUE(rig.says("bucket in (curl): at its end"));
  rig.view.machine.position_rad[kBucket] = rig.machine.links[kBucket].max_rad;
  EXPECT_TRUE(rig.says("bucket out: at its end"));
  TextRig near;
  near.view.machine.limits = kLimitJointRange | kLimitPumpFlow;
  near.view.machine.position_rad[kArm] =
      near.machine.links[kArm].min_rad + 0.9 * near.machine.limits.joint_soft_margin_rad;
  EXPECT_TRUE(near.says("arm in: at its end")) << "the hand meets a wall there";
  EXPECT_TRUE(near.says("pump flow"));
  EXPECT_EQ(near.limits().size(), 2u) << "said once, with its joint";
  TextRig far;
  far.view.machine.limits = kLimitJointRange;
  EXPECT_TRUE(far.says("joint range")) << "which joint is not known: not kept back";
  rig.view.machine.pressure_Pa[0] = rig.machine.hydraulics.main_relief_Pa;
  EXPECT_TRUE(rig.says("boom up: oil at relief")) << "its cylinder lifts by extending";
  rig.view.machine.limits = kLimitPumpFlow;
  rig.measured = false;
  EXPECT_EQ(rig.limits(), std::vector<std::string>{"pump flow"});
  rig.view.link.heard = false;
  EXPECT_TRUE(rig.limits().empty());
}

/// The arm pushes out with 220 bar, the bucket in with 205 bar.
JointLoads pressing() {
  JointLoads loads;
  loads[kArm] = {.pushes = 1,
                 .beyond_Nm = 9000,
                 .reach_m = 1.5,
                 .pressure_Pa = 219.6e5,
                 .at_relief = true,
                 .steady = true,
                 .lasts = true};
  loads[kBucket] = {.pushes = -1,
                    .beyond_Nm = 1000,
                    .reach_m = 0.5,
                    .pressure_Pa = 205e5,
                    .at_relief = true,
                    .steady = true,
                    .lasts = true};
  return loads;
}

TEST(BlindPress, IsSaidOfAForceThatIsNotKnownWithTheJointsThatPressAndTheLeastThatItIs) {
  TextRig rig;
  rig.view.machine.confidence = 0.03;
  const auto said = [&rig](const JointLoads& loads) { return blind_press(rig.view, loads).text; };
  JointLoads loads = pressing();
  EXPECT_EQ(said(loads), "pressing hard; cannot be measured: arm and bucket at relief");
  EXPECT_DOUBLE_EQ(blind_press(rig.view, loads).least_N, 6000);
  loads[kArm].at_relief = loads[kBucket].at_relief = false;
  EXPECT_EQ(said(loads), "pressing; cannot be measured: arm 220 bar, bucket 205 bar");
  loads[kArm].end = 1;
  EXPECT_DOUBLE_EQ(blind_press(rig.view, loads).least_N, 6000) << "near its end, but on no steel: on something else";
  loads[kArm].at_steel = 1;
  EXPECT_EQ(said(loads), "pressing; cannot be measured: bucket 205 bar") << "the arm pushes on its own end";
  EXPECT_DOUBLE_EQ(blind_press(rig.view, loads).least_N, 2000);
  loads[kBucket].steady = false;
  EXPECT_EQ(said(loads), "") << "the bucket starts or turns round; the arm is at its own end";
  rig.view.machine.confidence = 0.9;
  EXPECT_EQ(said(pressing()), "") << "its number is shown";
}

TEST(StillPressing, NamesWhatItsOilPressesWithWhereItLastsAndTheForceIsNotKnownToBeNone) {
  TextRig rig;
  rig.view.machine.mode = Mode::kReady;
  EXPECT_EQ(still_pressing(rig.view, pressing()), "") << "it is known not to touch anything";
  rig.view.machine.confidence = 0.03;
  EXPECT_EQ(still_pressing(rig.view, pressing()), "still pressing: arm 220 bar, bucket 205 bar");
  EXPECT_EQ(shut_in(rig.view, pressing()), "");
  JointLoads curled = pressing();
  curled[kBucket].at_steel = -1;
  EXPECT_EQ(still_pressing(rig.view, curled), "still pressing: arm 220 bar");
  EXPECT_EQ(shut_in(rig.view, curled), "oil shut in, bucket 205 bar");
  JointLoads brief = curled;
  brief[kArm].lasts = brief[kBucket].lasts = false;
  EXPECT_EQ(still_pressing(rig.view, brief) + shut_in(rig.view, brief), "");
  for (const Mode mode : {Mode::kFault, Mode::kEStop, Mode::kAligning, Mode::kEngaged, Mode::kHold}) {
    rig.view.machine.mode = mode;
    const bool led = mode != Mode::kFault && mode != Mode::kEStop;
    EXPECT_EQ(still_pressing(rig.view, curled).empty(), led) << name(mode);
    EXPECT_TRUE(!led || shut_in(rig.view, curled).empty()) << name(mode);
  }
}

TEST(FeelsEndOfRange, WhereItsWallBeginsForTheHandsOwnRequestAndNotBefore) {
  TextRig rig;
  rig.view.machine.mode = Mode::kEngaged;
  rig.view.hand.presence = true;
  rig.view.hand.ghost_rad = rig.view.machine.position_rad;
  const double wall_rad = rig.machine.links[kArm].max_rad - rig.machine.limits.joint_soft_margin_rad;
  rig.view.hand.ghost_rad[kArm] = wall_rad - 0.001;
  EXPECT_FALSE(feels_end_of_range(rig.view, rig.machine));
  rig.view.hand.ghost_rad[kArm] = wall_rad + 0.001;
  EXPECT_TRUE(feels_end_of_range(rig.view, rig.machine));
}

TEST(LessFelt, HasAReasonWheneverTheHandDoesNotFeelTheMachinesWholeForce) {
  constexpr double kNotRecorded = std::numeric_limits<double>::quiet_NaN();
  const Reason none, watchdog{ReasonCode::kEnergyWatchdog, 0, 0.04F, 0.03F};
  const struct {
    Mode mode;
    double confidence;
    Reason warning;
    const char* brief;
  } kCases[]{{Mode::kEngaged, 0.9, none, ""},
             {Mode::kEngaged, 0.07, none, "force not known"},
             {Mode::kEngaged, 0.25, none, "force not sure"},
             {Mode::kEngaged, 0.9, watchdog, "less force felt"},
             {Mode::kEngaged, kNotRecorded, none, ""},
             {Mode::kReady, 0.07, none, ""}};  // nobody leads it: nothing is felt
  for (const auto& one : kCases) {
    TextRig rig;
    rig.view.machine.mode = one.mode;
    rig.view.machine.confidence = one.confidence;
    rig.view.hand.warning = one.warning;
    EXPECT_EQ(less_felt(rig.view).brief, one.brief) << name(one.mode) << ' ' << one.confidence;
  }
}

TEST(PieceNews, IsOfTheLastSecondsOnly) {
  TextRig rig;
  rig.view.simulated = true;
  rig.view.simulated_s = 20;
  EXPECT_EQ(piece_news(rig.view), "");
  rig.view.truth.events.push({sim::WorldEventKind::kPieceBroke, 0, 19, 820});
  EXPECT_EQ(piece_news(rig.view), "a piece broke off");
  rig.view.truth.events.push({sim::WorldEventKind::kPieceDown, 0, 19.5, 45});
  EXPECT_EQ(piece_news(rig.view), "a piece fell to the ground") << "the newest";
  rig.view.simulated_s = 24.9;
  EXPECT_EQ(piece_news(rig.view), "");
}

TEST(ReasonText, TellSomebodyAtTheKeysOfKeysAndNotOfAHandOnADevice) {
  for (const ReasonCode code : {ReasonCode::kNoPresence, ReasonCode::kEnableNotPressed, ReasonCode::kPresenceLost}) {
    EXPECT_EQ(reason_text({code}, {}, HandSource::kDevice), text(Reason{code}));
    EXPECT_TRUE(test::says(reason_text({code}, {}, HandSource::kKeyboard), "Shift"));
    EXPECT_TRUE(test::says(reason_text({code}, {}, HandSource::kGamepad), "bumper"));
  }
  const Reason other{ReasonCode::kEmergencyStop};
  EXPECT_EQ(reason_text(other, {}, HandSource::kKeyboard), text(other));
}

TEST(LinkVerdict, TheWorstOfWhatWasMeasuredDecides) {
  constexpr double kNotRecorded = std::numeric_limits<double>::quiet_NaN();
  const struct {
    double loss, round_trip_s, jitter_s, silent_s;
    LinkQuality quality;
    const char* text;
  } kLinks[]{{0, 0.024, 0.001, 0, LinkQuality::kGood, ""},
             {0.3, 0.024, 0.001, 0, LinkQuality::kPoor, "30 % lost"},
             {0, 0.18, 0.001, 0, LinkQuality::kFair, ""},
             {0, 0.024, 0.06, 0, LinkQuality::kPoor, ""},
             {0, 0.024, 0.001, 0.15, LinkQuality::kPoor, ""},  // time to neutral runs out
             {0, kNotRecorded, 0.001, 0, LinkQuality::kBad, "round trip not known"},
             {1, kNotRecorded, 0.001, 0, LinkQuality::kBad, "100 % lost"}};
  LinkSide link;
  EXPECT_FALSE(link_verdict(link, 0));
  link.heard = true;
  link.neutral_after_s = 0.2;
  link.silence_s = 0.004;
  for (const auto& is : kLinks) {
    link.loss = is.loss;
    link.round_trip = link.arrival_jitter = {};
    if (std::isfinite(is.round_trip_s)) link.round_trip.add(from_seconds(is.round_trip_s));
    link.arrival_jitter.add(from_seconds(is.jitter_s));
    const auto verdict = link_verdict(link, is.silent_s);
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->quality, is.quality) << verdict->text;
    EXPECT_TRUE(test::says(verdict->text, is.text));
  }
  link.loss = kNotRecorded;
  EXPECT_FALSE(link_verdict(link, 0)) << "one side was recorded: no judgement";
}

TEST(EventTime, IsTheTimeOfDayWhereTheSessionRunsByTheClock) {
  EXPECT_EQ(event_time(Time(12'500ms), 0), "12.500");
  const std::string by_clock = event_time(Time(1'250ms), 1'700'000'000'000'000'000);
  ASSERT_EQ(by_clock.size(), std::string("14:03:22.125").size()) << by_clock;
  EXPECT_EQ(by_clock.substr(5), ":21.250") << "22:13:20 UTC and 1.25 s, whatever the time zone";
}

}  // namespace
}  // namespace knuckle::console
