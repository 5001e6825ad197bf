// The keyboard alone: it gets to everything that can be operated, on every screen; where it is, is seen; and it leads
// no machine.
#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <utility>

#include "tests/console/window/keyboard_walk.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class KeyboardFocus : public ShownConsole {
 protected:
  void SetUp() override {
    ShownConsole::SetUp();
    if (!console_) return;
    // As much to be operated as there can be: nothing is locked, and every choice has its own settings.
    view_.machine.mode = Mode::kReady;
    state().hold_to_run = state().measures.grade_on = state().measures.has_point = true;
    state().assist.force_limit_N = 1000;
    frames();
  }
  [[nodiscard]] HandInput hand() const { return console_->input(view_.now).hand; }

  struct Focused {
    ImGuiID id = 0;
    Box box{};
  };
  [[nodiscard]] static Focused focused() {
    const ImGuiContext& g = *GImGui;
    if (g.NavId == 0 || g.NavWindow == nullptr || !g.IO.NavVisible) return {};
    const ImRect& r = g.NavWindow->NavRectRel[g.NavLayer];
    const ImVec2 p = g.NavWindow->Pos;
    return {g.NavId, {int(p.x + r.Min.x), int(p.y + r.Min.y), int(p.x + r.Max.x), int(p.y + r.Max.y)}};
  }
  /// Of the item's border the share that has the ring's colour within a few pixels.
  [[nodiscard]] double ringed(const Pixels& p, const Box& box) {
    constexpr int kWithin = 6;
    int all = 0, seen = 0;
    const auto look = [&](int x, int y, int dx, int dy) {
      ++all;
      for (int i = -kWithin; i <= kWithin; ++i) {
        const int u = x + i * dx, v = y + i * dy;
        if (u < 0 || v < 0 || u >= p.width || v >= p.height || !p.near(u, v, theme().colours.text, 30)) continue;
        ++seen;
        return;
      }
    };
    for (int x = box.left + 8; x < box.right - 8; x += 2) {
      look(x, box.top, 0, 1);
      look(x, box.bottom, 0, 1);
    }
    for (int y = box.top + 8; y < box.bottom - 8; y += 2) {
      look(box.left, y, 1, 0);
      look(box.right, y, 1, 0);
    }
    return all == 0 ? 0 : double(seen) / all;
  }
  KeyboardWalk walk_{[this](int count) { frames(count); }};
};

constexpr std::array kScreenKeys{"F1", "F2", "F3", "F4", "F5", "F6", "F7"};

TEST_F(KeyboardFocus, ReachesEverythingThatCanBeOperatedOnEveryScreenAndIsSeenThere) {
  // Passed by: pictures, plots and the pad, which are led by keys; words above a table's columns, which do nothing.
  const std::set<std::string> passed_by{"picture", "plot",      "boom up",    "boom down", "arm out",
                                        "arm in",  "bucket in", "bucket out", "Severity",  "Time",
                                        "Time, s", "Code",      "What",       ""};
  std::size_t items = 0;
  const auto has_ring = [&] {
    const Pixels drawn = pixels();
    const Focused at = focused();
    EXPECT_GT(ringed(drawn, at.box), 0.7)
        << at.box.left << ' ' << at.box.top << ' ' << at.box.right << ' ' << at.box.bottom;
    ++items;
  };
  for (const char* screen : kScreenKeys) {
    SCOPED_TRACE(screen);
    does(std::string("key ") + screen);
    for (const auto& [id, item] : walk_.items())
      EXPECT_TRUE(!item.pointer_alone || passed_by.count(item.name) == 1) << item.name;
    EXPECT_EQ(walk_.missed(has_ring), "");
  }
  EXPECT_GT(items, 100u);
  EXPECT_FALSE(state().stop) << "moving about presses nothing";
  does("key F1 key space");
  ASSERT_TRUE(state().stop);
  EXPECT_TRUE(walk_.go_to("Release (Ctrl+Backspace)"));
  does("key F7 key bracketleft");
  EXPECT_TRUE(walk_.go_to("##next") && walk_.go_to("Back to now")) << "around a chosen time";
}

TEST_F(KeyboardFocus, GoesOnByTabBackByCtrlAndTabToANeighbourByArrowsAndChangesNothingByPassing) {
  walk_.press("Tab");
  const ImGuiID first = KeyboardWalk::focused();
  walk_.press("Tab");
  EXPECT_NE(KeyboardWalk::focused(), first);
  walk_.press("ctrl+Tab");
  EXPECT_EQ(KeyboardWalk::focused(), first);
  const float before_ms = state().simulation.delay_ms;
  ASSERT_TRUE(walk_.go_to("##Delay"));
  const ImGuiID slider = KeyboardWalk::focused();
  walk_.press("Down");
  EXPECT_EQ(walk_.items().at(KeyboardWalk::focused()).name, "##Jitter");
  walk_.press("Up");
  EXPECT_EQ(KeyboardWalk::focused(), slider);
  EXPECT_EQ(state().simulation.delay_ms, before_ms);
  walk_.press("Return");
  walk_.press("Right");
  EXPECT_GT(state().simulation.delay_ms, before_ms) << "from Enter on";
}

TEST_F(KeyboardFocus, PressesAndTypesFromEnterOnAndNotFromTabOn) {
  ASSERT_TRUE(walk_.go_to("##height"));
  EXPECT_FALSE(ImGui::GetIO().WantTextInput) << "keys still lead";
  const double before_m = state().measures.grade.point_m.y();
  walk_.press("Return");
  EXPECT_TRUE(ImGui::GetIO().WantTextInput);
  does("key 2");
  walk_.press("Tab");
  EXPECT_FALSE(ImGui::GetIO().WantTextInput);
  EXPECT_NE(state().measures.grade.point_m.y(), before_m) << "what was typed stays";
  EXPECT_NE(KeyboardWalk::focused(), 0u);
  ASSERT_TRUE(walk_.go_to("Grade line"));
  walk_.press("Return");
  EXPECT_FALSE(state().measures.grade_on);
  ASSERT_TRUE(walk_.go_to("Stop"));
  EXPECT_FALSE(state().stop);
  walk_.press("Return");
  EXPECT_TRUE(state().stop);
}

/// Hold to run is on, and then enable is held, too, while the keyboard goes everywhere and presses everything.
TEST_F(KeyboardFocus, LeadsNoMachineByTabArrowsOrEnter) {
  const auto expect_still = [&](bool enabled, const std::string& where) {
    EXPECT_LE(hand().enable, enabled) << where;
    EXPECT_EQ(hand().rate_radps, JointVector::Zero()) << where;
  };
  constexpr std::array<std::pair<bool, const char*>, 4> kWalks{
      {{false, "F1"}, {true, "F1"}, {true, "F6"}, {true, "F7"}}};
  for (const auto& [enabled, screen] : kWalks) {
    does(enabled ? "keydown shift" : "keyup shift");
    does(std::string("key ") + screen);
    EXPECT_EQ(hand().enable, enabled);
    const std::size_t steps = walk_.items().size() + 1;
    const Screen shown = state().screen;
    for (std::size_t i = 0; i < steps; ++i) {
      state().screen = shown;
      for (const char* key : {"Tab", "Return"}) {
        ASSERT_TRUE(xdotool(std::string("keydown ") + key));
        frames(2);
        expect_still(enabled, std::string(screen) + ' ' + std::to_string(i) + ' ' + key);
        ASSERT_TRUE(xdotool(std::string("keyup ") + key));
        frames(1);
      }
    }
    for (const char* arrow : {"Up", "Left", "Down", "Right"}) {
      walk_.press(arrow);
      expect_still(enabled, arrow);
    }
    does("keyup shift");
  }
  EXPECT_FALSE(hand().enable);
}

TEST_F(KeyboardFocus, StaysWhereItIsWhileTheMouseLeads) {
  const auto items = walk_.items();
  const auto pad =
      std::find_if(items.begin(), items.end(), [](const auto& one) { return one.second.name == "arm in"; });
  ASSERT_NE(pad, items.end());
  const ImVec2 at = pad->second.box.GetCenter();
  move_mouse(int(at.x), int(at.y));
  does("mousedown 1");
  ASSERT_TRUE(hand().enable);
  const JointVector led = hand().rate_radps;
  ASSERT_LT(led[kArm], 0);
  walk_.press("Tab");
  EXPECT_TRUE(hand().enable);
  EXPECT_EQ(hand().rate_radps, led);
  does("mouseup 1");
  EXPECT_FALSE(hand().enable);
}

}  // namespace
}  // namespace knuckle::console::window
