// Which item has the keyboard. Tab goes through all items of a frame in the order in which they are drawn: Dear ImGui's
// own Tab knows only fields and sliders, changes them at once, and does not leave the list that it is in.
#pragma once

#include <cstddef>
#include <vector>

#include "app/console/widgets/area.h"

struct ImGuiWindow;

namespace knuckle::console::widgets {

class FocusOrder {
 public:
  enum class Move { kNone, kOn, kBack };

  /// To the next item, or to the one before, at the end of the frame. Not while a mouse button is held: what it pulls
  /// or holds keeps the machine enabled.
  void ask(Move move) noexcept { asked_ = move; }
  /// The item made last is one of them, unless it is disabled or out of sight.
  void add_last_item();
  /// After a frame's items.
  void end_frame();

 private:
  struct Item {
    unsigned id;
    ImGuiWindow* window;
    Area area;
  };
  static void go(const Item& item);
  [[nodiscard]] std::size_t target(Move move) const;
  [[nodiscard]] std::size_t entered(std::size_t index) const;

  std::vector<Item> items_;
  std::size_t at_ = 0;  ///< Where the focus was last; what comes after an item that is gone takes its place.
  bool found_ = false;  ///< The item that has it is in this frame.
  Move asked_ = Move::kNone;
};

}  // namespace knuckle::console::widgets
