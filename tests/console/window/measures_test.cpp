// Distances and depth in the picture: a grade line, the load in the bucket, where the bucket touched something, and a
// ground that is drawn only where it is known.
#include "machine/kinematics.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class PictureMeasures : public ShownConsole {
 protected:
  [[nodiscard]] PlanarVector tip() const { return kinematics_.tip(view_.machine.position_rad); }
  [[nodiscard]] Eigen::Vector2i place(const PlanarVector& at_m) const {
    return seen_at(at_m).array().round().cast<int>();
  }
  [[nodiscard]] Box around(const PlanarVector& at_m, int by) const {
    const Eigen::Vector2i p = place(at_m);
    return {p.x() - by, p.y() - by, p.x() + by, p.y() + by};
  }
  [[nodiscard]] std::optional<double> over_grade() const {
    for (const screens::Distance& d : screens::distances(tip(), console_->state().measures, facts_.machine.limits, {}))
      if (d.has_sign) return d.m;
    return std::nullopt;
  }

  screens::ConsoleFacts facts_ = canned_facts();
  Kinematics kinematics_{facts_.machine};
};

TEST_F(PictureMeasures, GradeLineIsTakenFromTheTipsPlacesByKeysWhereThatIsKnownAndDrawnAcrossThePicture) {
  constexpr Box kBeside{472, 94, 712, 550};  // of the window of 1280x800
  const ImU32 colour = theme().colours.series[3], notice = theme().colours.notice;
  const Pixels before = pixels();
  EXPECT_LT(count_near(before, picture_box(), colour), 20);
  EXPECT_FALSE(over_grade());
  does("key y");
  EXPECT_FALSE(state().measures.grade_on);
  EXPECT_NE(state().measures.said.find("take a point"), std::string::npos);
  EXPECT_GT(count_near(pixels(), kBeside, notice), count_near(before, kBeside, notice)) << "the person sees it";
  const double heard_s = view_.link.silence_s;
  for (const char* key : {"t", "g"}) {
    view_.link.silence_s = 3;
    does(std::string("key ") + key);
    EXPECT_NE(state().measures.said, "") << key;
    view_.link.silence_s = heard_s;
    frames();
    EXPECT_FALSE(state().measures.grade_on) << "nor is it taken later";
    EXPECT_FALSE(state().measures.ground_m);
  }
  ASSERT_TRUE(xdotool("key t"));
  console_->frame(view_, loop_, events_, 2);  // the loops put nothing for two seconds
  console_->show();
  frames();
  EXPECT_FALSE(state().measures.grade_on);
  does("key t");
  const PlanarVector first = tip();
  EXPECT_EQ(state().measures.said, "");
  EXPECT_NEAR(over_grade().value(), 0, 1e-12);
  EXPECT_GT(count_near(pixels(), picture_box(), colour), 300) << "level, across the picture";
  does("key y");
  EXPECT_NE(state().measures.said.find("0 mm from the point"), std::string::npos) << state().measures.said;
  view_.machine.position_rad[kArm] += 0.15;
  EXPECT_NEAR(over_grade().value(), tip().y() - first.y(), 1e-12);
  EXPECT_GT(over_grade().value(), 0.1) << "above: positive";
  does("key y");
  EXPECT_NEAR(over_grade().value(), 0, 1e-9);
  const double slope = (tip().y() - first.y()) / (tip().x() - first.x());
  EXPECT_NEAR(state().measures.grade.slope, slope, 1e-9);
}

TEST_F(PictureMeasures, GradeLineIsTypedInThePersonsUnitAboveTheChosenGroundWithinItsBounds) {
  does("key g");
  const double ground_m = tip().y();
  click(534, 163);  // Grade line
  ASSERT_TRUE(state().measures.grade_on);
  const auto type = [this](int y, const std::string& keys) {
    click(640, y);
    EXPECT_TRUE(state().typing);
    if (keys.front() == '-') does("key minus");
    does("type --delay 30 " + keys.substr(keys.front() == '-' ? 1 : 0));
    press("Return");
    EXPECT_FALSE(state().typing);
  };
  type(193, "-0.4");
  EXPECT_NEAR(state().measures.grade.point_m.y() - ground_m, -0.4, 1e-9);
  type(223, "5");
  EXPECT_NEAR(state().measures.grade.slope, 0.05, 1e-9);
  type(223, "900");
  EXPECT_EQ(state().measures.grade.slope, 2);
  EXPECT_EQ(state().measures.said, "slope 900 % is beyond 200: limited");
  does("key F10");
  type(193, "1");
  EXPECT_NEAR(state().measures.grade.point_m.y() - ground_m, 0.3048, 1e-9);
  EXPECT_FALSE(state().stop);
  click(640, 193);
  ASSERT_TRUE(state().typing);
  does("key space");
  EXPECT_TRUE(state().stop) << "where a number is typed, there are no blanks";
}

TEST_F(PictureMeasures, HaveAGridThatIsZoomedByKeyAndWheelAndBackAgain) {
  const Pixels whole = pixels();
  does("key Prior");
  const Pixels closer = pixels();
  EXPECT_GT(count_changed(whole, closer, picture_box()), 5000);
  does("mousemove 420 330 click 4 click 4");
  EXPECT_GT(count_changed(closer, pixels(), picture_box()), 5000);
  does("key z");
  EXPECT_EQ(count_changed(whole, pixels(), picture_box()), 0);
}

TEST_F(PictureMeasures, DrawTheEstimatedLoadInTheBucket) {
  view_.machine.contact = false;
  view_.machine.tip_force_N = PlanarVector::Zero();
  const Frame2 bucket = pose_of(facts_.machine, view_.machine.position_rad).bucket;
  const BucketProfile& profile = facts_.machine.bucket_profile;
  const PlanarVector inside = bucket * PlanarVector(0.5 * (profile.back_m + 0.5 * profile.edge_m));
  const Box box = around(inside, 16);
  const auto loaded = [&](double kg, double sigma_kg) {
    view_.machine.payload_kg = kg;
    view_.machine.payload_sigma_kg = sigma_kg;
    return pixels();
  };
  const Pixels empty = loaded(0, 1);
  const int some = count_changed(empty, loaded(30, 2), box), full = count_changed(empty, loaded(130, 2), box);
  EXPECT_GT(some, 40);
  EXPECT_GT(full, 1.5 * some);
  EXPECT_EQ(count_changed(empty, loaded(130, 400), box), 0) << "not known: not drawn";
  view_.machine.payload_kg = 0;
  view_.machine.payload_sigma_kg = 1;
  view_.simulated = true;
  view_.truth.joint_rad = {0, 0, 0};
  EXPECT_EQ(count_changed(empty, pixels(), box), 0) << "nothing of the simulation's truth";
}

TEST_F(PictureMeasures, LeaveATrailOfContactsThatFades) {
  const PlanarVector touched = tip();
  frames();
  view_.machine.contact = false;
  view_.machine.position_rad[kBoom] += 0.3;
  view_.hand.set_point_rad = view_.hand.ghost_rad = view_.machine.position_rad;
  const Pixels fresh = pixels();
  view_.now += 40s;
  const Pixels later = pixels();
  view_.now += 40s;
  const Pixels gone = pixels();
  const Box box = around(touched, 6);
  const auto redness = [&](const Pixels& p) {
    int most = 0;
    for (int y = box.top; y < box.bottom; ++y)
      for (int x = box.left; x < box.right; ++x) most = std::max(most, p.at(x, y)[0] - p.at(x, y)[2]);
    return most;
  };
  EXPECT_GT(redness(fresh), redness(later) + 20);
  EXPECT_GT(redness(later), redness(gone) + 10);
}

TEST_F(PictureMeasures, OfAMachineElsewhereHaveNoGroundButTheChosenOne) {
  view_.simulated = false;
  view_.machine.position_rad = {0.9, -0.9, -0.5};  // away from what is looked at
  view_.hand.set_point_rad = view_.hand.ghost_rad = view_.machine.position_rad;
  const double under_m = -0.25 * reach_m(facts_.machine) - 0.03 * reach_m(facts_.machine);
  const Eigen::Vector2i below = place({1.1, under_m});
  const Box under{below.x() - 12, below.y() - 2, below.x() + 12, below.y() + 2};
  const picture::Rgb background = 255 * picture::dark_picture_colours().background;
  const ImU32 plain = IM_COL32(background.x(), background.y(), background.z(), 255);
  EXPECT_GT(count_near(pixels(), under, plain), 60) << "nothing is known to be there";
  sim::WorldDescription world;
  world.ground = sim::GroundDescription{.height_m = ground_level_m(facts_.machine)};
  console_->show_world(world);
  EXPECT_EQ(count_near(pixels(), under, plain), 0);
  console_->show_world({});
  const Pixels before = pixels();
  does("key g");
  const int y = place(tip()).y();
  EXPECT_GT(count_changed(before, pixels(), {picture_box().left, y - 3, picture_box().right, y + 3}), 100)
      << "a dashed line";
}

}  // namespace
}  // namespace knuckle::console::window
