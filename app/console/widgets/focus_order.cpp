#include "app/console/widgets/focus_order.h"

#include <imgui_internal.h>

#include <algorithm>
#include <utility>

namespace knuckle::console::widgets {

void FocusOrder::add_last_item() {
  const ImGuiLastItemData& item = GImGui->LastItemData;
  if ((item.InFlags & ImGuiItemFlags_Disabled) != 0 || !ImGui::IsItemVisible()) return;
  items_.push_back({item.ID, ImGui::GetCurrentWindow(), {item.NavRect.Min, item.NavRect.Max}});
}

void FocusOrder::end_frame() {
  const auto focused =
      std::find_if(items_.begin(), items_.end(), [](const Item& item) { return item.id == GImGui->NavId; });
  found_ = focused != items_.end();
  if (found_) at_ = static_cast<std::size_t>(focused - items_.begin());
  const Move move = std::exchange(asked_, Move::kNone);
  if (move != Move::kNone && !items_.empty() && !ImGui::IsAnyMouseDown()) {
    at_ = target(move);
    go(items_[at_]);
  }
  items_.clear();
}

/// A list is one step, however long it is: arrows move in it.
std::size_t FocusOrder::target(Move move) const {
  const std::size_t count = items_.size(), from = std::min(at_, count - 1);
  if (!found_ && move == Move::kOn) return entered(at_ % count);
  const std::size_t step = move == Move::kOn ? 1 : count - 1;
  std::size_t to = (from + step) % count;
  const auto in_same_list = [&] {
    return found_ && items_[to].window == items_[from].window && items_[to].window->ParentWindow != nullptr;
  };
  while (to != from && in_same_list()) to = (to + step) % count;
  return entered(to);
}

/// Of a list the item that had the focus there last, if it is in sight; else the first one.
std::size_t FocusOrder::entered(std::size_t index) const {
  const ImGuiWindow* const window = items_[index].window;
  if (window->ParentWindow == nullptr) return index;
  const auto find = [this](const auto& is) {
    return static_cast<std::size_t>(std::find_if(items_.begin(), items_.end(), is) - items_.begin());
  };
  const ImGuiID last = window->NavLastIds[ImGuiNavLayer_Main];
  const std::size_t again = find([&](const Item& item) { return item.window == window && item.id == last; });
  return again < items_.size() ? again : find([&](const Item& item) { return item.window == window; });
}

void FocusOrder::go(const Item& item) {
  ImGui::ClearActiveID();  // ends typing: what was typed stays
  ImGui::FocusWindow(item.window);
  ImGui::SetNavID(item.id, ImGuiNavLayer_Main, 0,
                  ImGui::WindowRectAbsToRel(item.window, {item.area.min, item.area.max}));
  GImGui->NavDisableHighlight = false;
}

}  // namespace knuckle::console::widgets
