// What Operate has to say is there whole.
#include "app/console/screens/screens.h"
#include "estimation/force_estimator.h"
#include "tests/console/window/keyboard_walk.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class Operate : public ShownConsole {};

TEST_F(Operate, ShowsEveryLineOfWhyTheForceIsNotKnownBetterAndDotsWhereItHasNoRoomForAll) {
  for (unsigned bit = 0; bit < estimation::kConfidenceReasons; ++bit) {
    for (const unsigned beside : {0U, unsigned{estimation::kBiasNotLearned}, unsigned{estimation::kStuckFriction}}) {
      view_.status.force_doubts = static_cast<std::uint16_t>(1U << bit | beside);
      const std::string words = screens::confidence_text(view_);
      const std::vector<DrawnText> seen = drawn_with(words);
      ASSERT_EQ(seen.size(), 1u) << words;
      EXPECT_LE(seen[0].cut_px, 0) << words;
    }
  }
  view_.status.force_doubts = 0xFF;
  const std::vector<DrawnText> seen = drawn_with(screens::confidence_text(view_).substr(0, 20));
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_LE(seen[0].cut_px, 0);
  EXPECT_TRUE(seen[0].text.ends_with("...")) << seen[0].text;
}

class Words : public ShownConsole {
 protected:
  /// The arm pushes out as hard as it can, and nobody knows with which force.
  void press_blindly() {
    view_.machine.confidence = 0.03;
    view_.machine.pressure_Pa[2] = 4e5;
    view_.machine.pressure_Pa[3] = 219.6e5;
  }
  static constexpr Box kModeBlock{12, 12, 328, 82};
  static constexpr Box kModeIcon{30, 28, 68, 66};
};

TEST_F(Words, AForceThatCannotBeMeasuredIsSaidToPressHardAndItsGaugeShowsTheLeastThatItIs) {
  EXPECT_FALSE(draws("cannot be measured"));
  const Box gauge{700, 94, 1032, 300};
  const int before = count_near(pixels(), gauge, theme().colours.bad);
  press_blindly();
  EXPECT_TRUE(draws("pressing hard; cannot be measured: arm at relief"));
  EXPECT_EQ(draws_exactly("At least"), 1);
  EXPECT_EQ(draws_exactly("Not known"), 0);
  state().force_most_N = 2000;
  frames();
  EXPECT_GT(count_near(pixels(), gauge, theme().colours.bad), before + 300) << "beyond the maximum set";
}

TEST_F(Words, AMachineThatStillPressesHasNoTickAndAnAmberEdgeAndSoHasOneOfWhichLessIsFelt) {
  const auto amber = [this] { return count_near(pixels(), kModeBlock, theme().colours.notice); };
  view_.machine.pressure_Pa = {};
  EXPECT_LT(amber(), 20);
  view_.machine.confidence = 0.07;
  EXPECT_EQ(draws_exactly("force not known"), 1);
  EXPECT_GT(amber(), 1000);
  view_.machine.confidence = 0.9;
  view_.hand.warning = {ReasonCode::kEnergyWatchdog, 0, 0.04F, 0.03F};
  EXPECT_EQ(draws_exactly("less force felt"), 1);
  EXPECT_GT(amber(), 1000);
  view_.hand.warning = {};
  view_.machine.mode = Mode::kReady;
  view_.machine.contact = false;
  view_.machine.velocity_radps.setZero();
  const Pixels calm = pixels();
  EXPECT_LT(count_near(calm, kModeBlock, theme().colours.notice), 20);
  press_blindly();
  EXPECT_FALSE(draws("still pressing")) << "an arm that swings on its oil does so, too";
  view_.now += PushWatch::kLasts;
  EXPECT_EQ(draws_exactly("still pressing: arm 220 bar"), 2) << "below the mode, and as what there is to know now";
  EXPECT_GT(amber(), 1000);
  EXPECT_GT(count_changed(calm, pixels(), kModeIcon), 150) << "another icon than the tick";
}

TEST_F(Words, AJointAtItsEndIsNamedInTheBannerAndAmongTheLimitsAndHasARingInThePicture) {
  constexpr Box kPicture{112, 92, 472, 502};
  EXPECT_FALSE(draws("at its end"));
  const int before = count_near(pixels(), kPicture, theme().colours.notice);
  view_.machine.position_rad[kBucket] = console_->facts().machine.links[kBucket].max_rad;
  EXPECT_TRUE(draws("bucket out: at its end, move it the other way"));
  EXPECT_EQ(draws_exactly("bucket out: at its end"), 1);
  EXPECT_GT(count_near(pixels(), kPicture, theme().colours.notice), before + 50);
  for (const DrawnText& text : drawn_with("at its end"))
    EXPECT_FALSE(text.max.x > kPicture.left && text.min.x < kPicture.right && text.max.y > kPicture.top &&
                 text.min.y < kPicture.bottom)
        << "words lie over the machine: " << text.text;
  view_.link.silence_s = 3;
  EXPECT_FALSE(draws("at its end")) << "nobody knows where it is now";
}

TEST_F(Words, WhatIsNotKnownHasNoIntervalAndADirectionIsAWord) {
  EXPECT_EQ(draws_exactly("From the front"), 1);
  EXPECT_EQ(draws_exactly("From below"), 1);
  EXPECT_EQ(draws_exactly("1410"), 1) << "without a sign";
  EXPECT_FALSE(draws("Forward"));
  view_.machine.tip_force_N = {1410, -380};
  EXPECT_EQ(draws_exactly("From behind"), 1);
  EXPECT_EQ(draws_exactly("From above"), 1);
  EXPECT_TRUE(draws("\xC2\xB1 2.3 kg"));
  view_.machine.payload_sigma_kg = 428;
  EXPECT_FALSE(draws("428"));
  view_.machine.tip_force_N = {-150, 25};
  view_.machine.covariance_N2 = {603.0 * 603, 0, 603.0 * 603};
  EXPECT_FALSE(draws("\xC2\xB1 603 N"));
  EXPECT_EQ(draws_exactly("< 755"), 1);
  EXPECT_EQ(draws_exactly("From the front") + draws_exactly("From behind"), 0) << "so small a force has no direction";
}

TEST_F(Words, AnUncalibratedMachineStandsOutUntilThePersonAcceptsThatByMouseOrKeyAndThenIsASmallMark) {
  view_.status.calibrated = false;
  view_.status.machine = MachineName("solar015");
  EXPECT_EQ(draws_exactly("UNCALIBRATED: OK?"), 1);
  ASSERT_TRUE(KeyboardWalk([this](int count) { frames(count); }).go_to("UNCALIBRATED: OK?"));
  press("Return");
  EXPECT_EQ(draws_exactly("UNCALIBRATED: OK?"), 0);
  EXPECT_EQ(draws_exactly("uncalibrated"), 1);
  EXPECT_FALSE(state().stop);
  view_.status.machine = MachineName("another");
  EXPECT_EQ(draws_exactly("UNCALIBRATED: OK?"), 1) << "which is not the one that was accepted";
  const DrawnText button = drawn_with("UNCALIBRATED: OK?").at(0);
  click(int(button.min.x + button.max.x) / 2, int(button.min.y + button.max.y) / 2);
  EXPECT_EQ(draws_exactly("uncalibrated"), 1);
}

TEST_F(Words, StoppedIsAsRedAsStopItselfWhateverElseStands) {
  view_.machine.mode = Mode::kFault;
  view_.machine.fault = {ReasonCode::kOperatorStop, 0, 0, 0};
  const Pixels stopped = pixels();
  EXPECT_GT(count_near(stopped, kModeBlock, theme().colours.stop), 10'000);
  EXPECT_GT(count_near(stopped, kModeBlock, theme().colours.stop_text), 2000) << "a frame, and the word";
  for (const Mode mode : {Mode::kReady, Mode::kHold, Mode::kEngaged, Mode::kOff}) {
    view_.machine.fault = {};
    view_.machine.mode = mode;
    EXPECT_LT(count_near(pixels(), kModeBlock, theme().colours.stop), 100) << name(mode);
  }
}

}  // namespace
}  // namespace knuckle::console::window
