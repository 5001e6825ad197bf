// The camera of a simulated machine: pictures of what truly is, stamped with when it was.
#include "app/console/picture/simulated_camera.h"

#include <gtest/gtest.h>

#include "tests/console/window/canned_console.h"

namespace knuckle::console::window {
namespace {

class SimulatedCameraPicture : public testing::Test {
 protected:
  /// The picture of this, as soon as there is one.
  std::unique_ptr<video::Frame> picture_of(const ConsoleView& view, Time at, Duration delay = {}) {
    camera_.show({at, view.simulated_s, view.truth.joint_rad, view.truth.events}, delay);
    for (int i = 0; i < 12'000; ++i, std::this_thread::sleep_for(5ms))
      if (auto frame = pictures_.take(); frame && frame->captured == at) return frame;
    ADD_FAILURE() << "no picture: " << camera_.status().why.data();
    return nullptr;
  }
  static std::size_t differing(const video::Frame& a, const video::Frame& b) {
    std::size_t count = 0;
    for (int i = 0; i < a.row_bytes * a.height_px; ++i) count += a.pixels[i] != b.pixels[i] ? 1U : 0U;
    return count;
  }

  const MachineDescription machine_ = canned_facts().machine;
  video::Newest<video::Frame> pictures_;
  picture::SimulatedCamera camera_{machine_, machine_.cameras.at(0),
                                   [this](std::unique_ptr<video::Frame> frame) { pictures_.put(std::move(frame)); }};
};

TEST_F(SimulatedCameraPicture, ShowsTheTruePoseNotTheMeasuredOneAndTheWallsOfTheWorld) {
  ConsoleView view = canned_view();
  view.truth.joint_rad = {0.5, -1.2, -0.4};
  const Time now = video::now();
  const auto first = picture_of(view, now);
  view.machine.position_rad = {0.2, -0.9, 0.1};
  const auto measured = picture_of(view, now + 1us);
  view.truth.joint_rad = {0.4, -1.2, -0.4};
  const auto moved = picture_of(view, now + 2us);
  camera_.begin(canned_world());
  const auto with_wall = picture_of(view, now + 3us);
  ASSERT_TRUE(first && measured && moved && with_wall);
  EXPECT_EQ(first->width_px, picture::SimulatedCamera::kWidth_px);
  EXPECT_EQ(differing(*first, *measured), 0u);
  EXPECT_GT(differing(*first, *moved), 1000u);
  EXPECT_GT(differing(*moved, *with_wall), 100'000u);
}

TEST_F(SimulatedCameraPicture, ArrivesAsLateAsTheLinkIs) {
  const auto frame = picture_of(canned_view(), video::now(), 150ms);
  ASSERT_TRUE(frame);
  EXPECT_GE(frame->received - frame->captured, 150ms);
}

}  // namespace
}  // namespace knuckle::console::window
