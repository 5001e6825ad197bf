// What the eyes that dismantle by the picture see of the bucket, against where it is.
#include "tests/console/window/eyes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "app/console/picture/simulated_camera.h"
#include "machine/kinematics.h"
#include "sim/contact.h"
#include "tests/console/window/canned_console.h"
#include "video/newest.h"

namespace knuckle::test {
namespace {

const double kDegree_rad = M_PI / 180;

TEST(EyesOnTheBucket, SeeItsTipAndHowFarForwardAnyPartOfItReaches) {
  const MachineDescription machine = console::window::canned_facts().machine;
  const Eyes eyes(machine, machine.cameras.at(0));
  const sim::BucketOutline outline(machine);
  video::Newest<video::Frame> pictures;
  console::picture::SimulatedCamera camera(
      machine, machine.cameras.at(0), [&](std::unique_ptr<video::Frame> frame) { pictures.put(std::move(frame)); });
  double furthest_before_tip_m = 0;
  for (const double bucket_deg : {-20.0, -40.0, -60.0, -75.0}) {
    const auto joints = Kinematics(machine).inverse({2.2, -0.1}, bucket_deg * kDegree_rad);
    ASSERT_TRUE(joints);
    const Time at = video::now();
    camera.show({at, 0, *joints, {}});
    std::unique_ptr<video::Frame> frame;
    for (int i = 0; i < 12'000 && !(frame && frame->captured == at); ++i, std::this_thread::sleep_for(5ms))
      if (auto next = pictures.take()) frame = std::move(next);
    ASSERT_TRUE(frame);
    const auto seen = eyes.bucket(*frame);
    ASSERT_TRUE(seen) << bucket_deg;
    const Frame2 bucket = pose_of(machine, *joints).bucket;
    double foremost_m = 0;
    for (std::size_t i = 0; i < sim::kCorners; ++i) foremost_m = std::max(foremost_m, (bucket * outline.corner(i)).x());
    EXPECT_NEAR(seen->tip_m.x(), 2.2, 0.03) << bucket_deg;
    EXPECT_NEAR(seen->tip_m.y(), -0.1, 0.03) << bucket_deg;
    EXPECT_NEAR(seen->foremost_m, foremost_m, 0.03) << bucket_deg;
    furthest_before_tip_m = std::max(furthest_before_tip_m, foremost_m - 2.2);
  }
  EXPECT_GT(furthest_before_tip_m, 0.09) << "curled in, it is the heel that touches first";
}

}  // namespace
}  // namespace knuckle::test
