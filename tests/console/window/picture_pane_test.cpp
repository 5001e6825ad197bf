// Nothing lies over the machine: what there is to read and to press is beside its picture; and all limits are there.
#include "app/console/screens/picture_pane.h"

#include <algorithm>
#include <string>

#include "app/console/machine_text.h"
#include "tests/console/window/keyboard_walk.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

bool apart(const Area& a, ImVec2 min, ImVec2 max) {
  return max.x <= a.min.x || min.x >= a.max.x || max.y <= a.min.y || min.y >= a.max.y;
}

class PicturePane : public ShownConsole {
 protected:
  void add_camera() {
    console_->cameras().add({"mast", [this] { return std::move(next_); }, [] { return video::CameraStatus{}; }});
    next_ = red_frame(video::now() + 10s);  // live, however slowly the window is drawn
    frames();
  }
  void expect_nothing_over_the_machine() {
    std::vector<DrawnText> texts;
    const std::map<ImGuiID, DrawnItem> items = items_of([&] { texts = drawn(); });
    const Area machine = console_->machine_picture().value();
    EXPECT_GT(machine.width(), 150);
    EXPECT_GT(machine.height(), 80);
    for (const DrawnText& text : texts) EXPECT_TRUE(apart(machine, text.min, text.max)) << text.text;
    for (const auto& [id, item] : items)
      EXPECT_TRUE(item.name == "picture" || apart(machine, item.box.Min, item.box.Max)) << item.name;
  }
  std::unique_ptr<video::Frame> next_;
};

TEST_F(PicturePane, HasNothingOverTheMachineWhateverIsSwitchedOn) {
  for (const bool camera : {false, true}) {
    if (camera) add_camera();
    for (const bool large : {false, true}) {
      if (large && !camera) continue;
      if (camera && large != console_->cameras().large()) does("key x");
      ASSERT_EQ(console_->cameras().large(), large);
      for (const int height : {720, 800}) {
        resize(1280, height);
        for (const bool all : {false, true})
          for (const bool side : {false, true}) {
            SCOPED_TRACE(std::to_string(height) + (camera ? " camera" : "") + (large ? " large" : "") +
                         (all ? " all" : "") + (side ? " side" : " orbit"));
            state().hold_to_run = state().measures.grade_on = all;
            state().measures.say(all ? "slope: take a point of the line first (T)" : "");
            state().side_view = side;
            frames(2);
            expect_nothing_over_the_machine();
          }
      }
    }
  }
}

TEST_F(PicturePane, TellsByAnArrowAtItsEdgeWhereTheBucketIsThatHasLeftIt) {
  const auto arrow = [this]() -> std::optional<ImVec2> {
    for (const DrawnText& text : drawn())
      if (text.text == "bucket" && !apart(console_->machine_picture().value(), text.min, text.max))
        return ImVec2{(text.min.x + text.max.x) / 2, (text.min.y + text.max.y) / 2};
    return std::nullopt;
  };
  frames();
  const Box box = picture_box();
  const ImVec2 middle{float(box.left + box.right) / 2, float(box.top + box.bottom) / 2};
  EXPECT_FALSE(arrow());
  move_mouse(box.left + 80, box.bottom - 120);
  does("click --repeat 12 4");  // closer to the tracks, away from the bucket
  const auto right = arrow();
  ASSERT_TRUE(right);
  EXPECT_GT(right->x, middle.x) << "it is ahead of what is shown";
  const Pixels seen = pixels();
  EXPECT_GT(count_near(seen, {box.right - 30, box.top, box.right, box.bottom}, theme().colours.notice), 60);
  does("key z");
  EXPECT_FALSE(arrow());
  move_mouse(box.right - 40, box.top + 30);
  does("click --repeat 12 4");
  const auto left = arrow();
  ASSERT_TRUE(left);
  EXPECT_GT(left->y, middle.y) << "below";
  view_.link.heard = false;
  EXPECT_FALSE(arrow()) << "nobody knows where it is";
}

TEST_F(PicturePane, HasAllLimitsBesideItHoweverManyThereAre) {
  const MachineDescription& machine = console_->facts().machine;
  view_.machine.limits = kLimitPumpFlow | kLimitRate | kLimitJointRange;
  view_.machine.pressure_Pa = {260e5, 22e5, 260e5, 91e5, 40e5, 260e5};
  for (std::size_t j = 0; j < kJoints; ++j)
    view_.machine.position_rad[static_cast<Eigen::Index>(j)] = machine.links[j].max_rad;
  const std::vector<std::string> all =
      limit_texts(view_, machine, Kinematics(machine), joint_loads(view_.machine, machine, Kinematics(machine)), true);
  ASSERT_GE(all.size(), 8u);
  for (const int height : {720, 800})
    for (const char* screen : {"key F1", "key F4"}) {
      resize(1280, height);
      does(screen);
      const std::vector<DrawnText> texts = drawn();
      for (const std::string& words : all) {
        const std::size_t colon = words.find(": ");
        const std::string last = colon == std::string::npos ? words : words.substr(colon + 2);
        const std::string first = colon == std::string::npos ? words : words.substr(0, colon);
        const bool there = std::any_of(texts.begin(), texts.end(), [&](const DrawnText& text) {
          return text.text.find(first) != std::string::npos && text.text.find(last) != std::string::npos &&
                 text.cut_px <= 0 && text.max.x < 1030 && text.max.y <= float(height);
        });
        EXPECT_TRUE(there) << words << " at " << height << ' ' << screen;
      }
    }
}

}  // namespace
}  // namespace knuckle::console::window
