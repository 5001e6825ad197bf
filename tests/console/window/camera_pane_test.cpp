// Cameras in the console's window: real keys, and the pixels that a person sees.
#include "app/console/screens/camera_pane.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "app/console/picture/camera.h"
#include "app/console/screens/picture_pane.h"
#include "machine/load.h"
#include "tests/console/window/shown_console.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::console::window {
namespace {

struct Pixel {
  int red = 0, green = 0, blue = 0;
  [[nodiscard]] bool is_red() const { return red > 200 && green < 60 && blue < 60; }
  [[nodiscard]] bool is_grey() const { return red == green && green == blue && red > 20; }
};

class CamerasInWindow : public ShownConsole {
 protected:
  static constexpr Duration kNotYet = -10s;  // live, however slowly the window is drawn
  // Of the window of 1280x800: on the camera's picture and on the small one, clear of all words.
  static constexpr std::array<int, 2> kLarge{260, 300}, kSmall{610, 470}, kSmallCamera{610, 500};

  void SetUp() override {
    ShownConsole::SetUp();
    if (!IsSkipped()) console_->show_world(canned_world());
  }
  void add_camera(const std::string& name) {
    console_->cameras().add({name, [this] { return std::move(next_); }, [this] { return status_; }});
  }
  /// A red picture that was captured so long ago.
  void picture(Duration ago, int width_px = 64, int red = 255) { next_ = red_frame(video::now() - ago, width_px, red); }
  void frames(int n = 3) {
    ShownConsole::frames(n);
    console_->frame(view_, loop_, events_, 0);  // to be read
  }
  [[nodiscard]] static Pixel at(const std::array<int, 2>& place) {
    std::array<std::uint8_t, 3> rgb{};
    glReadPixels(place[0], 799 - place[1], 1, 1, GL_RGB, GL_UNSIGNED_BYTE, rgb.data());
    return {rgb[0], rgb[1], rgb[2]};
  }
  /// Share of the camera's picture that is covered by something, below its title.
  [[nodiscard]] static double share_covered() {
    constexpr int kStep = 4;
    int covered = 0, all = 0;
    for (int x = 140; x < 680; x += kStep)
      for (int y = 140; y < 400; y += kStep, ++all) covered += at({x, y}).is_red() ? 0 : 1;
    return static_cast<double>(covered) / all;
  }
  /// How many pixels of the chips at the upper edge of the camera's picture stand out.
  [[nodiscard]] int marked() { return count_near(drawn_pixels(), {120, 96, 700, 134}, theme().colours.notice); }
  [[nodiscard]] std::string last_event() const { return events_.rows().empty() ? "" : events_.rows().back().text; }

  std::unique_ptr<video::Frame> next_;
  video::CameraStatus status_;
};

TEST_F(CamerasInWindow, FillTheLargestPaneAndChangePlacesWithTheMachineByAKey) {
  add_camera("mast");
  frames();
  EXPECT_FALSE(at(kLarge).is_red());
  const auto fresh = [this] {
    picture(kNotYet);
    frames();
  };
  fresh();
  EXPECT_TRUE(at(kLarge).is_red());
  EXPECT_FALSE(at(kSmall).is_red());
  EXPECT_EQ(last_event(), "camera mast: live picture");
  ASSERT_TRUE(xdotool("key x"));
  fresh();
  EXPECT_FALSE(at(kLarge).is_red());
  EXPECT_TRUE(at(kSmallCamera).is_red());
  ASSERT_TRUE(xdotool("key x"));
  fresh();
  EXPECT_TRUE(at(kLarge).is_red());
  console_->cameras().add({"rear", [] { return nullptr; }, [] { return video::CameraStatus{}; }});
  for (const bool large : {false, false, true}) {
    ASSERT_TRUE(xdotool("key x"));
    frames();
    EXPECT_EQ(console_->cameras().large(), large) << "rear never gave a picture: the machine keeps the pane";
  }
}

TEST_F(CamerasInWindow, ShowANewPictureAtOnceUnderWhatIsThereAndAllElseTenTimesASecond) {
  constexpr std::array<int, 2> kBackground{8, 790};
  add_camera("mast");
  picture(kNotYet);
  frames();
  const Pixel background = at(kBackground);
  const int chips = marked();
  const auto next = [&](int red) {
    picture(kNotYet, 64, red);
    console_->frame(view_, loop_, events_, 0);
    EXPECT_EQ(at(kLarge).red, red);
    return at(kBackground).red == background.red;
  };
  // Whole: dark. What would be drawn from then on: light.
  const auto whole = [&] {
    console_->show();
    console_->window().set_light(false);
    console_->frame(view_, loop_, events_, 0);
    console_->show();
    console_->window().set_light(true);
  };
  bool alone = false;
  // The processor draws here: a whole frame takes long. Unless the computer was busy for 100 ms.
  for (int i = 0; i < 20 && !alone; ++i) {
    whole();
    alone = next(100 + i);
  }
  EXPECT_TRUE(alone) << "a whole frame was drawn, which takes longer";
  EXPECT_EQ(marked(), chips);
  EXPECT_FALSE(at(kSmall).is_red()) << "the machine lies over the picture";
  whole();
  std::this_thread::sleep_for(110ms);
  EXPECT_FALSE(next(64)) << "pictures keep all else from being drawn";
  whole();
  ++view_.machine.limits;
  EXPECT_FALSE(next(65)) << "what must not be missed is";
  whole();
  ASSERT_TRUE(xdotool("keydown Shift_L"));
  EXPECT_FALSE(next(66)) << "a key has no answer";
  ASSERT_TRUE(xdotool("keyup Shift_L"));
  ASSERT_TRUE(xdotool("key F2"));  // another screen, without the picture
  frames();
  picture(kNotYet, 64, 128);
  console_->frame(view_, loop_, events_, 0);
  EXPECT_NE(at(kLarge).red, 128);
}

TEST_F(CamerasInWindow, KeepNoKeyWaitingHoweverFastTheyCome) {
  add_camera("mast");
  picture(kNotYet);
  frames();
  const auto next = [&] {
    picture(kNotYet);
    console_->frame(view_, loop_, events_, 0);
    return console_->input(view_.now);
  };
  EXPECT_FALSE(next().stop);
  ASSERT_TRUE(xdotool("keydown Shift_L"));
  EXPECT_TRUE(next().hand.enable);
  ASSERT_TRUE(xdotool("keyup Shift_L"));
  EXPECT_FALSE(next().hand.enable);
  ASSERT_TRUE(xdotool("key space"));
  EXPECT_TRUE(next().stop);
}

TEST_F(CamerasInWindow, ShowWhatCameMarkedWherePacketsWereLostAndTurnGreyWithAnAlarmAndAnEventWhenFrozen) {
  add_camera("rear");
  picture(kNotYet);
  frames();
  EXPECT_EQ(share_covered(), 0) << "its place is not in the machine's file: nothing is drawn over it";
  EXPECT_EQ(marked(), 0);
  for (int i = 0; i < 4; ++i) {  // of now, however slowly the window is drawn
    picture(kNotYet);
    next_->damaged = true;
    frames(0);
  }
  EXPECT_GT(marked(), 800);
  EXPECT_TRUE(at(kLarge).is_red()) << "shown as it came";
  EXPECT_TRUE(test::says(last_event(), "parts of the picture are old"));
  picture(280ms);
  frames();
  EXPECT_TRUE(at(kLarge).is_grey());
  EXPECT_TRUE(test::says(last_event(), "camera rear: video frozen"));
  picture(kNotYet);
  frames();
  EXPECT_TRUE(at(kLarge).is_red());
  EXPECT_TRUE(test::says(last_event(), "live picture again"));
}

TEST_F(CamerasInWindow, HaveTheMachineDrawnOverThemWhereTheirPlaceIsInTheMachineFile) {
  add_camera("mast");
  picture(kNotYet);
  frames();
  EXPECT_GT(share_covered(), 0.02);
  view_.link.silence_s = 1;
  picture(kNotYet);
  frames();
  EXPECT_EQ(share_covered(), 0) << "what was measured is old";
}

TEST_F(CamerasInWindow, ShowPicturesOfGStreamer) {
  console_->cameras().add(
      feed_of({"test", "videotestsrc is-live=true pattern=red ! video/x-raw,width=320,height=180,framerate=30/1"}));
  for (int i = 0; i < 2000 && !at(kLarge).is_red(); ++i) frames(1);
  EXPECT_TRUE(at(kLarge).is_red());
}

TEST(CameraTitle, LeavesTheAgeToBeReadHoweverLongTheNameIs) {
  ImFontAtlas fonts;
  const ImFont* font = fonts.AddFontDefault();
  ASSERT_TRUE(fonts.Build());
  const std::string age = "  +0.04 s";
  for (const std::size_t length : {std::size_t{3}, std::size_t{30}, std::size_t{300}}) {
    const std::string title = screens::camera_title(font, 160, std::string(length, 'm'), "+0.04 s");
    EXPECT_TRUE(title.ends_with(age)) << title;
    EXPECT_LE(text_width(font, title), 160) << title;
    EXPECT_EQ(title.substr(0, 3), "mmm");
  }
  EXPECT_EQ(screens::camera_title(font, 160, "mast", "+0.04 s"), "mast  +0.04 s");
  EXPECT_EQ(screens::camera_title(font, 160, "mast", ""), "mast");
}

/// Without a window: which clicks count, and as what.
class AlignByClicks : public testing::Test {
 protected:
  AlignByClicks() { view_.machine.velocity_radps.setZero(); }
  /// The machine comes into a pose and has stood there for so long.
  void stand(const JointVector& joint_rad, Duration rest) {
    view_.machine.position_rad = joint_rad;
    for (const Duration on : {Duration(10ms), rest}) {
      view_.now += on;
      align_.watch(view_, true);
    }
  }
  /// On the tip, as the machine's first camera sees it.
  void click(int width_px, int height_px) {
    const PlanarVector tip_m = Kinematics(machine_).tip(view_.machine.position_rad);
    const picture::Viewport port{.width_px = width_px, .height_px = height_px};
    const auto at =
        picture::pixel_of(picture::mounted_camera(machine_, machine_.cameras.at(0)), port, {tip_m.x(), 0, tip_m.y()});
    ASSERT_TRUE(at);
    align_.click(at->cwiseQuotient(Eigen::Vector2d(width_px, height_px)), width_px, height_px);
  }

  const MachineDescription machine_ = canned_facts().machine;
  ConsoleView view_ = canned_view();
  screens::CameraAlign align_{machine_, "rear"};
};

TEST_F(AlignByClicks, CountOnlyOnceTheMachineHasStoodStillForASecond) {
  view_.machine.velocity_radps = {0, 0.1, 0};
  stand({0.5, -1.2, -0.5}, 2s);
  view_.machine.velocity_radps.setZero();
  stand({0.55, -1.2, -0.5}, 20ms);
  click(1280, 720);
  EXPECT_TRUE(test::says(align_.text(), "stand still for a second"));
  EXPECT_TRUE(align_.marks().empty()) << "the picture is still one of the way there";
  stand({0.55, -1.2, -0.5}, 1s);
  click(1280, 720);
  EXPECT_EQ(align_.marks().size(), 1u) << align_.text();
}

TEST_F(AlignByClicks, CountAsWhereInThePictureTheyWereWhateverItsSize) {
  int clicked = 0;
  for (const double boom : {0.25, 0.55, 0.8})
    for (const double arm : {-0.7, -1.2, -1.7}) {
      stand({boom, arm, -0.5}, 2s);
      const int scale = 1 + clicked++ % 2;
      click(1280 / scale, 720 / scale);
    }
  EXPECT_EQ(align_.fit().refused, "");
  EXPECT_LT((align_.fit().camera.position_m - machine_.cameras.at(0).position_m).norm(), 0.02);
}

/// Aligning a camera that the machine's file does not know, which is where the one that it knows is.
class AlignCamera : public CamerasInWindow {
 protected:
  void SetUp() override {
    CamerasInWindow::SetUp();
    if (IsSkipped()) return;
    std::filesystem::current_path(folder_.path());  // where the result goes
    add_camera("rear");
    view_.machine.velocity_radps.setZero();
    show();
  }
  void TearDown() override { std::filesystem::current_path(before_); }
  void show() {
    picture(kNotYet, 1280);
    frames();
  }
  void press(const std::string& key) {
    ASSERT_TRUE(xdotool("key " + key));
    show();
  }
  /// The machine in this pose, for long enough.
  void stand(const JointVector& joint_rad) {
    view_.machine.position_rad = joint_rad;
    show();
    view_.now += 2s;
    show();
  }
  /// The machine in this pose, and a click where its tip is seen. @return whether that is on the picture.
  bool click_tip(const JointVector& joint_rad) {
    stand(joint_rad);
    const PlanarVector tip_m = Kinematics(machine_).tip(joint_rad);
    const picture::Viewport port{.width_px = 1280, .height_px = 720};
    const auto at =
        picture::pixel_of(picture::mounted_camera(machine_, machine_.cameras.at(0)), port, {tip_m.x(), 0, tip_m.y()});
    const Eigen::Vector2d share = at->cwiseQuotient(Eigen::Vector2d(1280, 720));
    if (share.minCoeff() < 0.02 || share.maxCoeff() > 0.98 || (share.x() > 0.6 && share.y() > 0.5)) return false;
    const screens::CameraPane::Placed* drawn = console_->cameras().drawn_large();
    if (drawn == nullptr) return false;
    const Area& large = drawn->picture;
    const auto x = static_cast<int>(double(large.min.x) + share.x() * double(large.width()));
    const auto y = static_cast<int>(double(large.min.y) + share.y() * double(large.height()));
    for (const std::string& step : {"mousemove " + std::to_string(x) + " " + std::to_string(y),
                                    std::string("mousedown 1"), std::string("mouseup 1")}) {
      EXPECT_TRUE(xdotool(step));
      show();
    }
    return true;
  }
  int click_poses() {
    int clicked = 0;
    for (const double boom : {0.25, 0.55, 0.8})
      for (const double arm : {-0.7, -1.2, -1.7}) clicked += click_tip({boom, arm, -0.5}) ? 1 : 0;
    return clicked;
  }

  const test::TemporaryFolder folder_;
  const std::filesystem::path before_ = std::filesystem::current_path();
  const MachineDescription machine_ = canned_facts().machine;
};

TEST_F(AlignCamera, FindsItByClicksOnTheTipAndSaysWhatRemains) {
  std::ofstream("camera_rear.toml") << "before";
  press("k");
  ASSERT_TRUE(console_->cameras().aligning());
  ASSERT_GE(click_poses(), 6);
  press("k");
  EXPECT_FALSE(console_->cameras().aligning());
  for (const char* words : {"camera rear: aligned, residual ", "camera_rear.toml", "the one before in "})
    EXPECT_TRUE(test::says(last_event(), words));
  EXPECT_EQ(test::content("camera_rear.1.toml"), "before") << "the file of the time before is kept";
  // Taken into the machine's file, it is where the other one is.
  std::ofstream("machine.toml") << machine_.text << "\n" << test::content("camera_rear.toml");
  const MachineDescription with = load_machine("machine.toml");
  ASSERT_EQ(with.cameras.size(), machine_.cameras.size() + 1);
  const CameraDescription &found = with.cameras.back(), &there = machine_.cameras.at(0);
  EXPECT_LT((found.position_m - there.position_m).norm(), 0.1);
  EXPECT_NEAR(found.pan_rad, there.pan_rad, 0.03);
  EXPECT_NEAR(found.tilt_rad, there.tilt_rad, 0.03);
  show();
  EXPECT_GT(share_covered(), 0.005) << "drawn over by it from now on";
}

TEST_F(AlignCamera, LeavesAClickOnTheMachinesSmallPictureToThatAndWritesNothingThatIsRefused) {
  console_->state().hold_to_run = true;
  press("k");
  stand({0.5, -1.2, -0.5});
  ASSERT_TRUE(xdotool("mousemove " + std::to_string(kSmall[0]) + " " + std::to_string(kSmall[1])));
  show();
  EXPECT_FALSE(console_->input(view_.now).hand.enable);
  ASSERT_TRUE(xdotool("mousedown 1"));
  show();
  EXPECT_TRUE(console_->input(view_.now).hand.enable) << "the tip is pulled there";
  ASSERT_TRUE(xdotool("mouseup 1"));
  show();
  press("k");
  EXPECT_TRUE(test::says(last_event(), "camera rear: not aligned: 0 of at least 6 poses"));
  EXPECT_EQ(folder_.count(), 0) << "nothing is written that is refused";
}

TEST_F(AlignCamera, SaysInAnEventWhereItsKeyDoesNothingOrAnotherPictureEndsIt) {
  press("k");
  ASSERT_TRUE(console_->cameras().aligning());
  press("x");
  EXPECT_FALSE(console_->cameras().aligning());
  EXPECT_EQ(last_event(), "camera rear: not aligned: another picture was made large");
  press("k");
  EXPECT_FALSE(console_->cameras().aligning()) << "the machine is large";
  EXPECT_EQ(last_event(), "nothing to align: no camera fills the pane (X makes another picture large)");
  press("x");
  console_->state().screen = Screen::kLink;
  press("k");
  EXPECT_FALSE(console_->cameras().aligning()) << "the picture is not on this screen";
}

TEST_F(CamerasInWindow, AreDrawnAsSoonAsTheSimulatedMachinesCameraHasAPicture) {
  console_->add_simulated_camera(canned_facts().machine.cameras.at(0));
  frames(1);
  console_->bell()->quiet();
  view_.simulated_s += 0.1;
  console_->frame(view_, loop_, events_, 0);
  EXPECT_TRUE(console_->bell()->wait_until(std::chrono::steady_clock::now() + 60s));
}

TEST(VideoAlarm, SaysHowOldThePictureIs) {
  EXPECT_EQ(screens::video_alarm(video::VideoState::kFrozen, 0.42), "VIDEO FROZEN 0.4 s");
  EXPECT_EQ(screens::video_alarm(video::VideoState::kLate, 1.26), "VIDEO LATE 1.3 s");
  EXPECT_EQ(screens::video_alarm(video::VideoState::kLive, 0.04), "");
}

TEST(CameraPicture, KeepsItsShape) {
  const Area wide = screens::fitted({{100, 50}, {500, 450}}, 16.0 / 9);
  EXPECT_FLOAT_EQ(wide.width(), 400);
  EXPECT_FLOAT_EQ(wide.height(), 225);
  EXPECT_FLOAT_EQ(wide.min.y, 50);
  const Area tall = screens::fitted({{100, 50}, {500, 150}}, 4.0 / 3);
  EXPECT_FLOAT_EQ(tall.height(), 100);
  EXPECT_FLOAT_EQ(tall.centre().x, 300);
}

}  // namespace
}  // namespace knuckle::console::window
