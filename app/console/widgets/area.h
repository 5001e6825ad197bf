// A rectangle on the screen that layouts cut into smaller ones.
#pragma once

#include <imgui.h>

#include <algorithm>

namespace knuckle::console::widgets {

/// Screen pixels. Cutting returns the piece and leaves the rest.
struct Area {
  ImVec2 min, max;

  [[nodiscard]] float width() const { return std::max(0.F, max.x - min.x); }
  [[nodiscard]] float height() const { return std::max(0.F, max.y - min.y); }
  [[nodiscard]] ImVec2 size() const { return {width(), height()}; }
  [[nodiscard]] ImVec2 centre() const { return {(min.x + max.x) / 2, (min.y + max.y) / 2}; }
  [[nodiscard]] Area inset(float x, float y) const { return {{min.x + x, min.y + y}, {max.x - x, max.y - y}}; }
  [[nodiscard]] Area inset(float by) const { return inset(by, by); }

  Area cut_top(float height, float gap = 0) {
    const Area piece{min, {max.x, std::min(max.y, min.y + height)}};
    min.y = std::min(max.y, piece.max.y + gap);
    return piece;
  }
  Area cut_bottom(float height, float gap = 0) {
    const Area piece{{min.x, std::max(min.y, max.y - height)}, max};
    max.y = std::max(min.y, piece.min.y - gap);
    return piece;
  }
  Area cut_left(float width, float gap = 0) {
    const Area piece{min, {std::min(max.x, min.x + width), max.y}};
    min.x = std::min(max.x, piece.max.x + gap);
    return piece;
  }
  Area cut_right(float width, float gap = 0) {
    const Area piece{{std::max(min.x, max.x - width), min.y}, max};
    max.x = std::max(min.x, piece.min.x - gap);
    return piece;
  }
  /// Column i of n of equal width.
  [[nodiscard]] Area column(int i, int n, float gap) const {
    const float w = (width() - gap * static_cast<float>(n - 1)) / static_cast<float>(n);
    const float x = min.x + static_cast<float>(i) * (w + gap);
    return {{x, min.y}, {x + w, max.y}};
  }
  [[nodiscard]] Area row(int i, int n, float gap) const {
    const float h = (height() - gap * static_cast<float>(n - 1)) / static_cast<float>(n);
    const float y = min.y + static_cast<float>(i) * (h + gap);
    return {{min.x, y}, {max.x, y + h}};
  }
};

}  // namespace knuckle::console::widgets
