// Simple facts about the picture: what is shown covers pixels of its colour, what is not shown covers none.
#include "app/console/picture/machine_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/console/picture/gl_program.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::console::window {
namespace {

constexpr int kWidth = 640, kHeight = 400;
const picture::Viewport kWhole{.width_px = kWidth, .height_px = kHeight};
using Drawn = std::vector<std::uint8_t>;

class MachineViewPicture : public ::testing::Test {
 protected:
  static MachineDescription machine() { return load_machine(test::source_dir() + "/config/machines/solar015.toml"); }

  Drawn drawn(const picture::MachinePicture& picture, const picture::Camera& camera,
              const picture::Viewport& viewport = kWhole) {
    view_.draw(picture, camera, viewport, colours_);
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    return screen_.pixels();
  }
  Drawn drawn(const picture::MachinePicture& picture) { return drawn(picture, side_); }

  static picture::MachinePicture at_rest() {
    picture::MachinePicture picture;
    picture.measured_rad = {0.5, -1.2, -0.4};
    return picture;
  }

  /// Of the picture's area; `near` is a colour in which something is drawn without shading.
  static double share_near(const Drawn& pixels, const picture::Rgb& near) {
    int count = 0;
    for (std::size_t i = 0; i < pixels.size(); i += 3) {
      const picture::Rgb own = picture::Rgb(pixels[i], pixels[i + 1], pixels[i + 2]) / 255.0F;
      if ((own - near).cwiseAbs().maxCoeff() < 0.02F) ++count;
    }
    return static_cast<double>(count) / (kWidth * kHeight);
  }
  static double share_changed(const Drawn& a, const Drawn& b) {
    int count = 0;
    for (std::size_t i = 0; i < a.size(); i += 3)
      if (a[i] != b[i] || a[i + 1] != b[i + 1] || a[i + 2] != b[i + 2]) ++count;
    return static_cast<double>(count) / (kWidth * kHeight);
  }

  picture::Offscreen screen_{kWidth, kHeight};
  picture::MachineView view_{machine()};
  picture::Camera side_ = picture::side_camera(machine()), orbit_ = picture::orbit_camera(machine());
  picture::PictureColours colours_ = picture::light_picture_colours();
};

TEST_F(MachineViewPicture, MachineAndGroundCoverPartOfItInEitherPalette) {
  for (const picture::Camera& camera : {side_, orbit_}) {
    const double background = share_near(drawn(at_rest(), camera), colours_.background);
    EXPECT_GT(background, 0.3);
    EXPECT_LT(background, 0.95);
  }
  picture::MachinePicture elsewhere = at_rest();
  elsewhere.measured_rad[kBoom] += 0.4;
  const Drawn first = drawn(at_rest());
  EXPECT_GT(share_changed(first, drawn(elsewhere)), 0.02) << "the arm moves with its joints";
  EXPECT_EQ(first, drawn(at_rest())) << "the same each time";
  colours_ = picture::dark_picture_colours();
  EXPECT_GT(share_changed(first, drawn(at_rest())), 0.9);
}

TEST_F(MachineViewPicture, HasAnArrowWhereAndOnlyWhereAForceIsAsSureAsItIs) {
  picture::MachinePicture picture = at_rest();
  const Drawn without = drawn(picture);
  picture.tip_force_N = {-4000, 0};
  const Drawn with = drawn(picture);
  EXPECT_GT(share_changed(without, with), 0.001);
  // The shaft lies behind the tip along the force; its lit side has the force's hue.
  const PlanarVector tip = pose_of(machine(), picture.measured_rad).tip_m;
  const auto pixel = picture::pixel_of(side_, kWhole, Eigen::Vector3d(tip.x() - 0.2, 0, tip.y()));
  const auto at = 3 * static_cast<std::size_t>((kHeight - 1 - static_cast<int>(pixel->y())) * kWidth +
                                               static_cast<int>(pixel->x()));
  EXPECT_GT(with[at], 1.5 * with[at + 1]);
  EXPECT_GT(with[at], 2.0 * with[at + 2]);
  const auto redness = [&](double confidence) {
    picture.confidence = confidence;
    const Drawn pixels = drawn(picture);
    double most = 0;
    for (std::size_t i = 0; i < pixels.size(); i += 3)
      most = std::max(most, static_cast<double>(pixels[i]) - pixels[i + 2]);
    return most;
  };
  EXPECT_GT(redness(1), redness(0) + 20) << "fades and loses its colour with its confidence";
  picture.confidence = 1;
  picture.covariance_N2 = {2e5, 0, 1e5};
  const double some = share_changed(with, drawn(picture));
  picture.covariance_N2 = {8e5, 0, 4e5};
  EXPECT_GT(some, 0.001);
  EXPECT_NEAR(share_changed(with, drawn(picture)) / some, 4, 1) << "the ellipse's area goes with the variance";
  picture.covariance_N2 = {};
  picture.tip_force_N = {-10, 0};
  EXPECT_EQ(without, drawn(picture)) << "noise is no arrow";
}

TEST_F(MachineViewPicture, OutlineOfTheCommandIsSeenWhenWanted) {
  picture::MachinePicture picture = at_rest();
  const Drawn without = drawn(picture);
  EXPECT_EQ(share_near(without, colours_.commanded), 0);
  picture.commanded_rad = picture.measured_rad + JointVector(0.1, 0.1, 0.1);
  EXPECT_GT(share_near(drawn(picture), colours_.commanded), 0.001);
}

TEST_F(MachineViewPicture, GhostOfTheHandIsSeenWhenWantedAndElsewhereThanTheMachine) {
  picture::MachinePicture picture = at_rest();
  const Drawn without = drawn(picture);
  picture.hand_rad = picture.measured_rad;
  EXPECT_LT(share_changed(without, drawn(picture)), 0.002) << "in the machine's own place it is hidden";
  *picture.hand_rad += JointVector(0.25, 0.2, 0.2);
  const Drawn with = drawn(picture);
  EXPECT_GT(share_changed(without, with), 0.01);
  picture.hand_rad.reset();
  EXPECT_EQ(without, drawn(picture));
}

TEST_F(MachineViewPicture, AStaleMachineLosesItsColour) {
  picture::MachinePicture picture = at_rest();
  const auto most_colour = [](const Drawn& pixels) {
    int most = 0;
    for (std::size_t i = 0; i < pixels.size(); i += 3) most = std::max(most, std::abs(pixels[i] - pixels[i + 2]));
    return most;
  };
  EXPECT_GT(most_colour(drawn(picture)), 80);
  picture.measured_is_stale = true;
  EXPECT_LT(most_colour(drawn(picture)), 40);
}

TEST_F(MachineViewPicture, ContactHasARingThatFlashesAtFirst) {
  picture::MachinePicture picture = at_rest();
  EXPECT_EQ(share_near(drawn(picture), colours_.force), 0);
  picture.contact = true;
  const double steady = share_near(drawn(picture), colours_.force);
  picture.contact_s = 0.05;
  EXPECT_GT(steady, 0);
  EXPECT_GT(share_near(drawn(picture), colours_.force), 1.5 * steady);
}

TEST_F(MachineViewPicture, ShowsTheSceneOfItsTime) {
  picture::MachinePicture picture = at_rest();
  const Drawn empty = drawn(picture);
  session::Scene scene{
      {"wall", session::SceneLine::Kind::kWall, {{2.3, 1}, {2.3, -1}, {2.8, -1}, {2.8, 1}}, true, 0, 10},
      {"piece", session::SceneLine::Kind::kPiece, {{1, -0.8}, {1.2, -0.8}, {1.2, -0.6}, {1, -0.6}}, true, 10, 99}};
  picture.scene = &scene;
  EXPECT_GT(share_changed(empty, drawn(picture)), 0.02);
  picture.scene_s = 10;
  const double piece = share_changed(empty, drawn(picture));
  EXPECT_GT(piece, 0.0005);
  EXPECT_LT(piece, 0.02);
}

TEST_F(MachineViewPicture, TheArmShinesThroughAWallInFrontOfIt) {
  picture::MachinePicture picture = at_rest();
  const PlanarVector tip = pose_of(machine(), picture.measured_rad).tip_m;
  const auto corner = [&](double x, double z) { return PlanarVector(tip + PlanarVector(x, z)); };
  const session::Scene block{{"wall",
                              session::SceneLine::Kind::kWall,
                              {corner(-0.3, 0.3), corner(-0.3, -0.3), corner(0.3, -0.3), corner(0.3, 0.3)},
                              true}};
  picture.scene = &block;
  const Drawn hiding = drawn(picture);
  picture.measured_rad[kBucket] -= 0.3;
  const Drawn moved = drawn(picture);
  // Well inside the block, where its own edges are not.
  const auto at = [&](double x, double z) { return *picture::pixel_of(side_, kWhole, {tip.x() + x, 0, tip.y() + z}); };
  const Eigen::Vector2i low = at(-0.25, 0.25).cast<int>(), high = at(0.25, -0.25).cast<int>();
  int changed = 0;
  for (int y = low.y(); y < high.y(); ++y)
    for (int x = low.x(); x < high.x(); ++x) {
      const auto i = 3 * static_cast<std::size_t>((kHeight - 1 - y) * kWidth + x);
      if (hiding[i] != moved[i]) ++changed;
    }
  EXPECT_GT(changed, 50) << "the bucket moves inside the block";
}

TEST_F(MachineViewPicture, LeavesTheRestOfTheWindowAlone) {
  glDisable(GL_SCISSOR_TEST);
  glClearColor(1, 0, 1, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  const picture::Viewport part{.left_px = 160, .bottom_px = 100, .width_px = 320, .height_px = 200};
  const double outside = share_near(drawn(at_rest(), orbit_, part), picture::Rgb(1, 0, 1));
  EXPECT_NEAR(outside, 0.75, 1e-9);
}

TEST(ForceScale, IsARoundNumberOfTheMachinesOwnSize) {
  for (const char* name : {"solar015", "compact080", "standard200"}) {
    const MachineDescription m = load_machine(test::source_dir() + "/config/machines/" + name + ".toml");
    const picture::ForceScale scale = picture::force_scale(m);
    const double digit = scale.full_N / std::pow(10, std::floor(std::log10(scale.full_N) + 1e-9));
    EXPECT_TRUE(std::abs(digit - 1) < 1e-6 || std::abs(digit - 2) < 1e-6 || std::abs(digit - 5) < 1e-6) << digit;
    EXPECT_GT(scale.full_N, 1000);
    EXPECT_LT(scale.full_N, 1e5);
  }
}

/// What a mounted camera sees, and what is drawn over its picture.
class MountedCameraPicture : public MachineViewPicture {
 protected:
  const picture::Camera camera_ = picture::mounted_camera(machine(), machine().cameras.at(0));
  picture::MachinePicture seen_ = [] {
    picture::MachinePicture p = at_rest();
    p.as_seen = true;
    return p;
  }();
  /// Where the bucket's tip is by the projection alone; pixels of the picture, y down.
  [[nodiscard]] Eigen::Vector2d tip_px() const {
    const PlanarVector tip = pose_of(machine(), seen_.measured_rad).tip_m;  // reads the file: not in a loop
    return picture::pixel_of(camera_, kWhole, {tip.x(), 0, tip.y()}).value();
  }
  [[nodiscard]] static std::vector<Eigen::Vector2d> changed(const Drawn& a, const Drawn& b) {
    std::vector<Eigen::Vector2d> places;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto i = 3 * static_cast<std::size_t>((kHeight - 1 - y) * kWidth + x);
        if (std::abs(a[i] - b[i]) + std::abs(a[i + 1] - b[i + 1]) + std::abs(a[i + 2] - b[i + 2]) > 40)
          places.emplace_back(x + 0.5, y + 0.5);
      }
    return places;
  }
};

TEST_F(MountedCameraPicture, HasTheBucketsTipWhereItIsProjected) {
  seen_.measured_rad[kBoom] = 0.9;  // high: there is nothing but sky below the teeth
  const Drawn pixels = drawn(seen_, camera_);
  const Eigen::Vector2d tip = tip_px();
  // The teeth end at the tip's height; the tip itself lies between two of them.
  int lowest = 0;
  for (int y = static_cast<int>(tip.y()) - 40; y < static_cast<int>(tip.y()) + 40; ++y)
    for (int x = static_cast<int>(tip.x()) - 12; x < static_cast<int>(tip.x()) + 12; ++x) {
      const auto i = 3 * static_cast<std::size_t>((kHeight - 1 - y) * kWidth + x);
      const picture::Rgb own = picture::Rgb(pixels[i], pixels[i + 1], pixels[i + 2]) / 255.0F;
      if ((own - colours_.background).cwiseAbs().maxCoeff() > 0.1F) lowest = y;
    }
  EXPECT_NEAR(lowest + 0.5, tip.y(), 2);
}

TEST_F(MountedCameraPicture, HasTheRingOfContactAroundTheTipOrWhereTheForceActs) {
  constexpr double kOffset_m = 0.2;
  const auto ring_at = [&](double offset_m) {
    seen_.line_offset_m = offset_m;
    picture::MachinePicture touching = seen_;
    touching.contact = true;
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& place : changed(drawn(seen_, camera_), drawn(touching, camera_))) box.extend(place);
    return Eigen::Vector2d(box.center());
  };
  EXPECT_LT((ring_at(0) - tip_px()).norm(), 4);
  seen_.tip_force_N = {0, 4000};
  const PlanarVector tip = pose_of(machine(), seen_.measured_rad).tip_m;
  const auto pixel = [&](double back_m) {
    return picture::pixel_of(camera_, kWhole, Eigen::Vector3d(tip.x() - back_m, 0, tip.y())).value();
  };
  const Eigen::Vector2d moved = ring_at(kOffset_m) - ring_at(0), expected = pixel(kOffset_m) - pixel(0);
  EXPECT_GT(expected.norm(), 10) << "else nothing is judged";
  EXPECT_LT((moved - expected).norm(), 0.3 * expected.norm());  // the arrow hides some of it
}

TEST_F(MountedCameraPicture, HidesWhatIsBehindAWall) {
  session::SceneLine wall;
  wall.kind = session::SceneLine::Kind::kWall;
  wall.closed = true;
  wall.points_m = {{0.9, -0.8}, {1.0, -0.8}, {1.0, 3}, {0.9, 3}};
  const session::Scene scene{wall};
  seen_.scene = &scene;
  picture::MachinePicture elsewhere = seen_;
  elsewhere.measured_rad[kBucket] = -2.3;
  EXPECT_TRUE(changed(drawn(seen_, camera_), drawn(elsewhere, camera_)).empty());
  seen_.as_seen = elsewhere.as_seen = false;
  EXPECT_FALSE(changed(drawn(seen_, camera_), drawn(elsewhere, camera_)).empty())
      << "to the operator it shines through";
}

TEST_F(MountedCameraPicture, IsKeptUnderTheOutlineDrawnOverIt) {
  const Drawn before = drawn(seen_, camera_);
  view_.draw_over(seen_, camera_, kWhole, colours_);
  const Drawn after = screen_.pixels();
  const double share = static_cast<double>(changed(before, after).size()) / (kWidth * kHeight);
  EXPECT_GT(share, 0.002);
  EXPECT_LT(share, 0.1);
}

}  // namespace
}  // namespace knuckle::console::window
