#include "tests/console/window/keyboard_walk.h"

#include <algorithm>

#include "tests/console/window/virtual_display.h"

namespace {
using knuckle::console::window::DrawnItem;
std::map<ImGuiID, DrawnItem>* drawn_items = nullptr;  // collected while it points somewhere
std::map<ImGuiID, std::string> labels;
}  // namespace

// Every item of Dear ImGui passes here: the linker puts these in the place of its own (tests/CMakeLists.txt).
extern "C" ImGuiID __real__ZN11ImGuiWindow5GetIDEPKcS1_(ImGuiWindow*, const char*, const char*);
extern "C" ImGuiID __wrap__ZN11ImGuiWindow5GetIDEPKcS1_(ImGuiWindow* window, const char* label, const char* end) {
  const ImGuiID id = __real__ZN11ImGuiWindow5GetIDEPKcS1_(window, label, end);
  if (drawn_items != nullptr) labels[id] = end == nullptr ? std::string(label) : std::string(label, end);
  return id;
}
extern "C" bool __real__ZN5ImGui7ItemAddERK6ImRectjPS1_i(const ImRect&, ImGuiID, const ImRect*, ImGuiItemFlags);
extern "C" bool __wrap__ZN5ImGui7ItemAddERK6ImRectjPS1_i(const ImRect& box, ImGuiID id, const ImRect* nav_box,
                                                         ImGuiItemFlags flags) {
  const bool drawn = __real__ZN5ImGui7ItemAddERK6ImRectjPS1_i(box, id, nav_box, flags);
  const int all = GImGui->LastItemData.InFlags;
  if (drawn_items == nullptr || id == 0 || (all & ImGuiItemFlags_Disabled) != 0 || !ImGui::IsItemVisible())
    return drawn;
  if (ImGui::GetCurrentWindow()->IsFallbackWindow) return drawn;  // Dear ImGui's own, which is not shown
  const auto& windows = GImGui->Windows;                          // a list as a whole is none
  if (std::none_of(windows.begin(), windows.end(), [id](const ImGuiWindow* w) { return w->ChildId == id; }))
    (*drawn_items)[id] = {labels[id], nav_box != nullptr ? *nav_box : box, (all & ImGuiItemFlags_NoNav) != 0};
  return drawn;
}

namespace knuckle::console::window {

std::map<ImGuiID, DrawnItem> items_of(const std::function<void()>& drawing) {
  std::map<ImGuiID, DrawnItem> all;
  drawn_items = &all;
  drawing();
  drawn_items = nullptr;
  return all;
}

std::map<ImGuiID, DrawnItem> KeyboardWalk::items() const {
  return items_of([this] { frames_(1); });
}

void KeyboardWalk::press(const std::string& key) const {
  ImGui::GetIO().KeyRepeatDelay = 1e6F;  // one step, however long two frames take here
  (void)xdotool("keydown " + key);
  frames_(2);
  (void)xdotool("keyup " + key);
  frames_(1);
}

ImGuiID KeyboardWalk::focused() {
  const ImGuiContext& g = *GImGui;
  return g.NavWindow == nullptr || !g.IO.NavVisible ? 0 : g.NavId;
}

std::set<ImGuiID> KeyboardWalk::reached(const std::function<void()>& at) const {
  constexpr int kMost = 300;  // steps
  std::set<ImGuiID> all;
  const auto new_here = [&] {
    const bool is_new = focused() != 0 && all.insert(focused()).second;
    if (is_new) at();
    return is_new;
  };
  const auto in_list = [] { return GImGui->NavWindow->ParentWindow != nullptr; };
  for (int i = 0; i < kMost; ++i) {
    press("Tab");
    if (!new_here()) break;  // around
    bool more = in_list();
    for (int row = 0; more && row < kMost; ++row) {
      press("Right");
      (void)new_here();
      press("Left");
      press("Down");
      more = new_here();
    }
  }
  return all;
}

std::string KeyboardWalk::missed(const std::function<void()>& at) const {
  const std::map<ImGuiID, DrawnItem> before = items();
  const std::set<ImGuiID> all = reached(at);
  std::string names;
  for (const auto& [id, item] : before)
    if (!item.pointer_alone && all.count(id) == 0)
      names += "'" + item.name + "' at " + std::to_string(static_cast<int>(item.box.Min.x)) + ", " +
               std::to_string(static_cast<int>(item.box.Min.y)) + "; ";
  return names;
}

bool KeyboardWalk::go_to(const std::string& name) const {
  const auto all = items();
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.second.name == name; });
  if (found == all.end()) return false;
  for (std::size_t i = 0; i <= all.size() && focused() != found->first; ++i) press("Tab");
  return focused() == found->first;
}

}  // namespace knuckle::console::window
