// Every text that a window draws, and whether it is seen whole.
#pragma once

#include <imgui.h>

#include <functional>
#include <string>
#include <vector>

namespace knuckle::console::window {

struct DrawnText {
  std::string text;
  ImVec2 min, max;   ///< Where it is.
  float cut_px = 0;  ///< So much of it lies below what is shown of its surroundings.
};
[[nodiscard]] std::vector<DrawnText> texts_of(const std::function<void()>& drawing);

}  // namespace knuckle::console::window
