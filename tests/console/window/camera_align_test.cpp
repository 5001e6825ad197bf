// Aligning a camera by clicks, without a window: which clicks count, and as what.
#include <gtest/gtest.h>

#include "app/console/picture/camera.h"
#include "app/console/screens/camera_pane.h"
#include "tests/console/window/canned_console.h"

namespace knuckle::console::window {
namespace {

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
  [[nodiscard]] bool says(const std::string& what) const { return align_.text().find(what) != std::string::npos; }

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
  EXPECT_TRUE(says("stand still for a second")) << align_.text();
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

}  // namespace
}  // namespace knuckle::console::window
