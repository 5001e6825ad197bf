// A person without a mouse: what there is to be pressed in a window, and where Tab, arrows and Enter get to.
#pragma once

#include <imgui_internal.h>

#include <functional>
#include <map>
#include <set>
#include <string>

namespace knuckle::console::window {

struct DrawnItem {
  std::string name;  ///< Dear ImGui's label.
  ImRect box;
  bool pointer_alone = false;  ///< Is said to be no item of the keyboard's.
};
/// What can be pressed, moved or typed into of all that is drawn meanwhile, as Dear ImGui itself is told of it.
[[nodiscard]] std::map<ImGuiID, DrawnItem> items_of(const std::function<void()>& drawing);

class KeyboardWalk {
 public:
  /// @param frames draws so many.
  explicit KeyboardWalk(std::function<void(int)> frames) : frames_(std::move(frames)) {}

  /// A key for ImGui itself, which does not see one that is shorter than a frame.
  void press(const std::string& key) const;
  /// Once around by Tab, and through lists by arrows. @param at is called wherever the focus gets to for the first
  /// time.
  [[nodiscard]] std::set<ImGuiID> reached(const std::function<void()>& at = [] {}) const;
  /// Names and places of those that all of this does not reach; empty: none.
  [[nodiscard]] std::string missed(const std::function<void()>& at = [] {}) const;
  /// By Tab. @return whether it is there.
  [[nodiscard]] bool go_to(const std::string& name) const;
  [[nodiscard]] std::map<ImGuiID, DrawnItem> items() const;
  /// 0 where no ring is shown.
  [[nodiscard]] static ImGuiID focused();

 private:
  std::function<void(int)> frames_;
};

}  // namespace knuckle::console::window
