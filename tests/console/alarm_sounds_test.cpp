// When the operator hears what: the worst first, a danger again and again, nothing twice for one event.
#include "app/console/alarm_sounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace knuckle::console {
namespace {

ConsoleView engaged() {
  ConsoleView view;
  view.link.heard = true;
  view.machine.mode = Mode::kEngaged;
  view.machine.confidence = 0.9;
  return view;
}

TEST(AlarmSounds, AreToldApartAndNoneClips) {
  std::set<std::vector<std::int16_t>> all;
  for (const AlarmSound sound : {AlarmSound::kContact, AlarmSound::kLimit, AlarmSound::kFault, AlarmSound::kLinkLost}) {
    const auto samples = samples_of(sound, 48000);
    ASSERT_FALSE(samples.empty());
    EXPECT_LT(samples.size(), 48000u) << "shorter than its repetition";
    EXPECT_LT(*std::max_element(samples.begin(), samples.end()), 20000);
    EXPECT_EQ(samples.front(), 0);
    all.insert(samples);
  }
  EXPECT_EQ(all.size(), 4u);
  EXPECT_TRUE(samples_of(AlarmSound::kNone, 48000).empty());
}

TEST(AlarmWatch, ALostLinkIsHeardUntilItIsBack) {
  AlarmWatch watch;
  int times = 0;
  for (double t_s = 0; t_s < 10; t_s += 0.02)
    times += watch.step(engaged(), t_s > 1, true, t_s) == AlarmSound::kLinkLost;
  EXPECT_EQ(times, 4) << "every 2.5 s of 9";
  for (double t_s = 10; t_s < 15; t_s += 0.02) EXPECT_EQ(watch.step(engaged(), false, true, t_s), AlarmSound::kNone);
  ConsoleView ended = engaged();
  ended.machine.mode = Mode::kOff;
  EXPECT_EQ(watch.step(ended, true, true, 20), AlarmSound::kNone) << "the machine's side said that it ends";
}

TEST(AlarmWatch, AFaultIsRepeatedUntilItIsAcknowledgedAndStopIsNone) {
  AlarmWatch watch;
  ConsoleView view = engaged();
  view.machine.mode = Mode::kFault;
  view.machine.fault = {ReasonCode::kSensorStale, 0x20, 30, 25};
  EXPECT_EQ(watch.step(view, false, false, 5), AlarmSound::kFault);
  EXPECT_EQ(watch.step(view, false, false, 6), AlarmSound::kNone);
  EXPECT_EQ(watch.step(view, false, false, 8), AlarmSound::kFault);
  EXPECT_EQ(watch.step(view, false, true, 20), AlarmSound::kNone) << "the person has seen it";
  AlarmWatch calm;
  view.machine.fault = {ReasonCode::kOperatorStop, 0, 0, 0};
  EXPECT_EQ(calm.step(view, false, false, 5), AlarmSound::kNone);
  view.machine.mode = Mode::kEStop;
  view.machine.fault = {ReasonCode::kEmergencyStop, 0, 0, 0};
  EXPECT_EQ(calm.step(view, false, false, 6), AlarmSound::kFault);
}

TEST(AlarmWatch, ContactAndLimitAreHeardOnceEachAndTheWorstFirst) {
  AlarmWatch watch;
  ConsoleView view = engaged();
  EXPECT_EQ(watch.step(view, false, true, 1), AlarmSound::kNone);
  view.machine.contact = true;
  EXPECT_EQ(watch.step(view, false, true, 2), AlarmSound::kContact);
  EXPECT_EQ(watch.step(view, false, true, 9), AlarmSound::kNone) << "the same contact";
  view.machine.limits = kLimitForceCeiling;
  EXPECT_EQ(watch.step(view, false, true, 10), AlarmSound::kLimit);
  view.machine.limits = kLimitRate;
  EXPECT_EQ(watch.step(view, false, true, 20), AlarmSound::kNone) << "happens at every motion";
  view.machine.contact = false;
  (void)watch.step(view, false, true, 21);
  view.machine.contact = true;
  view.machine.confidence = 0;
  EXPECT_EQ(watch.step(view, false, true, 30), AlarmSound::kNone) << "no contact is known";
  view.machine.confidence = 1;
  view.machine.limits = kLimitJointRange;
  EXPECT_EQ(watch.step(view, false, true, 31), AlarmSound::kLimit) << "of both, the more important";
}

}  // namespace
}  // namespace knuckle::console
