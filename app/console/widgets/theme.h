// How the console looks: colours, type, spacing. Designed for a screen that is trusted with a wall in front of the
// machine: calm surfaces, text of at least WCAG AA contrast, colour-blind-safe accents (Okabe and Ito 2008).
#pragma once

#include <imgui.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "transport/link_messages.h"

namespace knuckle::console {

// A rectangle on the screen that layouts cut into smaller ones.

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

/// Four sizes; numbers that change are set in mono so that they do not dance.
struct Fonts {
  ImFont *small = nullptr, *body = nullptr, *title = nullptr, *display = nullptr;
  ImFont* body_bold = nullptr;
  ImFont *mono_small = nullptr, *mono = nullptr, *mono_title = nullptr, *mono_display = nullptr;
};

/// B612, drawn for cockpits, from Debian's fonts-b612: read once, rasterised again whenever the scale changes.
class FontFiles {
 public:
  /// @throws InputError naming the file where one is missing or is no font. The folder is $KNUCKLE_FONT_DIR, or
  /// Debian's.
  FontFiles();
  /// Fills ImGui's atlas for this scale; the caller uploads it.
  [[nodiscard]] Fonts build(ImFontAtlas& atlas, float scale);

 private:
  ImFont* add(ImFontAtlas& atlas, std::size_t face, float size_px);
  std::array<std::vector<char>, 3> faces_;  ///< Regular, bold, mono.
};

/// One set of colours. Text colours reach a contrast of 4.5 on background, surface and raised.
struct Palette {
  ImU32 background, surface, raised, border;
  ImU32 text, muted;
  ImU32 accent;             ///< What can be chosen or is chosen.
  ImU32 good, notice, bad;  ///< Readable as text; never the only sign.
  ImU32 stop, stop_text;
  std::array<ImU32, 6> series;  ///< Lines and bars, told apart by order and label as well.
  ImU32 force;
};

[[nodiscard]] const Palette& dark_palette() noexcept;
[[nodiscard]] const Palette& light_palette() noexcept;
/// WCAG 2.1 contrast ratio, 1..21.
[[nodiscard]] double contrast(ImU32 a, ImU32 b) noexcept;
/// Black or white, whichever is better read on it.
[[nodiscard]] ImU32 text_on(ImU32 fill) noexcept;
[[nodiscard]] ImU32 mix(ImU32 a, ImU32 b, float share_of_b) noexcept;

struct Theme {
  Palette colours = dark_palette();
  Fonts fonts;
  float scale = 1;  ///< Screen pixels per pixel of the design.
  bool light = false;

  [[nodiscard]] float px(float design_pixels) const noexcept { return design_pixels * scale; }
  /// The one distance that all others are multiples of.
  [[nodiscard]] float unit(float times = 1) const noexcept { return 8 * times * scale; }
  [[nodiscard]] static ImU32 mode_colour(Mode mode) noexcept;
};

/// Hands colours and measures to Dear ImGui's own widgets.
void apply_style(const Theme& theme);

/// What the open window is drawn on.
[[nodiscard]] inline ImDrawList& canvas() {
  return *ImGui::GetWindowDrawList();
}
/// A colour as drawn now: paler inside what is greyed out. Everything drawn by hand passes through it.
[[nodiscard]] inline ImU32 ink(ImU32 colour) {
  return ImGui::GetColorU32(colour);
}

}  // namespace knuckle::console
