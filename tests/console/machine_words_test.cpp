// What the console says of force, limits and link: nothing that the machine does not know.
#include "app/console/machine_words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "app/console/event_book.h"
#include "app/console/link_quality.h"
#include "machine/load.h"

namespace knuckle::console {
namespace {

struct Rig {
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  Kinematics kinematics{machine};
  ConsoleView view;
  bool measured = true;

  Rig() {
    view.link.heard = true;
    view.machine.confidence = 0.9;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
      view.machine.position_rad[i] = 0.5 * (link.min_rad + link.max_rad);
    }
  }
  [[nodiscard]] std::vector<std::string> limits() const { return limits_in_words(view, machine, kinematics, measured); }
  [[nodiscard]] bool says(const std::string& words) const {
    const auto all = limits();
    return std::find(all.begin(), all.end(), words) != all.end();
  }
};

TEST(ForceWords, WithoutConfidenceThereIsNoForceAndNoContact) {
  Rig rig;
  rig.view.machine.contact = true;
  rig.view.machine.tip_force_N = {2695, 0};
  EXPECT_TRUE(force_words(rig.view).known);
  EXPECT_TRUE(force_words(rig.view).contact);
  rig.view.machine.confidence = kLeastConfidence;
  EXPECT_FALSE(force_words(rig.view).known);
  EXPECT_FALSE(force_words(rig.view).contact);
  EXPECT_STREQ(force_words(rig.view).contact_word, "Not known");
  rig.view.machine.confidence = 1;
  rig.view.link.heard = false;
  EXPECT_FALSE(force_words(rig.view).known);
}

TEST(LimitsInWords, NameTheJointAndItsDirection) {
  Rig rig;
  EXPECT_TRUE(rig.limits().empty());
  rig.view.machine.position_rad[kBucket] = rig.machine.links[kBucket].min_rad;
  EXPECT_TRUE(rig.says("bucket in (curl): end stop"));
  rig.view.machine.position_rad[kBucket] = rig.machine.links[kBucket].max_rad;
  EXPECT_TRUE(rig.says("bucket out: end stop"));
  Rig near;
  near.view.machine.position_rad[kArm] =
      near.machine.links[kArm].min_rad + 0.9 * near.machine.limits.joint_soft_margin_rad;
  EXPECT_TRUE(near.limits().empty()) << "nothing is limited there yet";
  near.view.machine.limits = kLimitJointRange | kLimitPumpFlow;
  EXPECT_TRUE(near.says("arm in: joint range"));
  EXPECT_TRUE(near.says("pump flow"));
  EXPECT_EQ(near.limits().size(), 2u) << "said once, with its joint";
  Rig far;
  far.view.machine.limits = kLimitJointRange;
  EXPECT_TRUE(far.says("joint range")) << "which joint is not known: not kept back";
}

TEST(LimitsInWords, NothingIsSaidOfAPoseThatIsNotKnown) {
  Rig rig;
  rig.view.machine.position_rad[kBucket] = rig.machine.links[kBucket].min_rad;
  rig.view.machine.limits = kLimitPumpFlow;
  rig.measured = false;
  EXPECT_EQ(rig.limits(), std::vector<std::string>{"pump flow"});
  rig.view.link.heard = false;
  EXPECT_TRUE(rig.limits().empty());
}

TEST(LimitsInWords, OilAtReliefIsThatAndNoContact) {
  Rig rig;
  rig.view.machine.pressure_Pa[0] = rig.machine.hydraulics.main_relief_Pa;
  EXPECT_EQ(rig.limits(), std::vector<std::string>{"boom up: oil at relief"}) << "its cylinder lifts by extending";
  rig.view.machine.pressure_Pa[0] = 0.9 * rig.machine.hydraulics.main_relief_Pa;
  EXPECT_TRUE(rig.limits().empty());
}

LinkSide good_link() {
  LinkSide link;
  link.heard = true;
  link.neutral_after_s = 0.2;
  link.silence_s = 0.004;
  link.round_trip.add(from_seconds(0.024));
  link.arrival_jitter.add(from_seconds(0.001));
  return link;
}

TEST(LinkVerdict, TheWorstOfWhatWasMeasuredDecides) {
  EXPECT_EQ(link_verdict(good_link(), 0)->quality, LinkQuality::kGood);
  LinkSide lossy = good_link();
  lossy.loss = 0.3;
  EXPECT_EQ(link_verdict(lossy, 0)->quality, LinkQuality::kPoor);
  EXPECT_EQ(link_verdict(lossy, 0)->words, "30 % lost");
  LinkSide far = good_link();
  far.round_trip = {};
  far.round_trip.add(from_seconds(0.18));
  EXPECT_EQ(link_verdict(far, 0)->quality, LinkQuality::kFair);
  LinkSide jittery = good_link();
  jittery.arrival_jitter = {};
  jittery.arrival_jitter.add(from_seconds(0.06));
  EXPECT_EQ(link_verdict(jittery, 0)->quality, LinkQuality::kPoor);
  EXPECT_EQ(link_verdict(good_link(), 0.15)->quality, LinkQuality::kPoor) << "time to neutral runs out";
  EXPECT_FALSE(link_verdict(LinkSide{}, 0));
  LinkSide unanswered = good_link();
  unanswered.round_trip = {};
  EXPECT_EQ(link_verdict(unanswered, 0)->quality, LinkQuality::kBad) << "what was not measured is not good";
  EXPECT_EQ(link_verdict(unanswered, 0)->words, "round trip not known");
  unanswered.loss = 1;
  EXPECT_EQ(link_verdict(unanswered, 0)->words, "100 % lost") << "which is why";
  LinkSide one_side = good_link();
  one_side.loss = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(link_verdict(one_side, 0)) << "not recorded: no judgement";
}

TEST(EventTime, IsTheTimeOfDayWhereTheSessionRunsByTheClock) {
  EXPECT_EQ(event_time(Time(12'500ms), 0), "12.500");
  const std::string by_clock = event_time(Time(1'250ms), 1'700'000'000'000'000'000);
  ASSERT_EQ(by_clock.size(), std::string("14:03:22.125").size()) << by_clock;
  EXPECT_EQ(by_clock.substr(5), ":21.250") << "22:13:20 UTC and 1.25 s, whatever the time zone";
}

}  // namespace
}  // namespace knuckle::console
