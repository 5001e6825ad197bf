// The keyboard alone: where it is, is seen, on every screen and on everything it can operate.
#include <imgui_internal.h>

#include <map>

#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class KeyboardFocus : public ShownConsole {
 protected:
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
  [[nodiscard]] double ringed(const Pixels& p, const Box& box) const {
    constexpr int kWithin = 6;
    int all = 0, seen = 0;
    const auto look = [&](int x, int y, int dx, int dy) {
      ++all;
      for (int i = -kWithin; i <= kWithin; ++i) {
        const int u = x + i * dx, v = y + i * dy;
        if (u < 0 || v < 0 || u >= p.width || v >= p.height || !p.near(u, v, theme_text(), 30)) continue;
        ++seen;
        return;
      }
    };
    for (int x = box.left + 8; x < box.right - 8; x += 2) look(x, box.top, 0, 1), look(x, box.bottom, 0, 1);
    for (int y = box.top + 8; y < box.bottom - 8; y += 2) look(box.left, y, 1, 0), look(box.right, y, 1, 0);
    return all == 0 ? 0 : double(seen) / all;
  }
  [[nodiscard]] ImU32 theme_text() const { return console_->window().theme().colours.text; }
};

TEST_F(KeyboardFocus, IsSeenAsARingAroundEverythingThatItReaches) {
  std::size_t items = 0;
  for (const char* screen : {"F1", "F2", "F3", "F4", "F5", "F6", "F7"}) {
    does(std::string("key ") + screen);
    std::map<ImGuiID, double> reached;
    for (const char* key : {"Tab", "Up", "Left", "Down", "Right"})
      for (int i = 0; i < 4; ++i) {
        press(key);
        const Pixels drawn = pixels();
        const Focused at = focused();
        if (at.id == 0 || reached.count(at.id) != 0) continue;
        reached[at.id] = ringed(drawn, at.box);
        EXPECT_GT(reached[at.id], 0.7) << screen << ", " << key << " " << i << ": " << at.box.left << ' ' << at.box.top
                                       << ' ' << at.box.right << ' ' << at.box.bottom;
      }
    EXPECT_GT(reached.size(), 1u) << screen;
    items += reached.size();
  }
  EXPECT_GT(items, 25u);
  EXPECT_FALSE(state().stop) << "moving about presses nothing";
}

}  // namespace
}  // namespace knuckle::console::window
