// How the console looks: colours, type, spacing. Designed for a screen that is trusted with a wall in front of the
// machine: calm surfaces, text of at least WCAG AA contrast, colour-blind-safe accents (Okabe and Ito 2008).
#pragma once

#include <imgui.h>

#include <array>

#include "transport/link_messages.h"

namespace knuckle::console::widgets {

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

/// Four sizes; numbers that change are set in mono so that they do not dance.
struct Fonts {
  ImFont *small = nullptr, *body = nullptr, *title = nullptr, *display = nullptr;
  ImFont* body_bold = nullptr;
  ImFont *mono_small = nullptr, *mono = nullptr, *mono_title = nullptr, *mono_display = nullptr;
};

struct Theme {
  Palette colours = dark_palette();
  Fonts fonts;
  float scale = 1;  ///< Screen pixels per pixel of the design.
  bool light = false;

  [[nodiscard]] float px(float design_pixels) const noexcept { return design_pixels * scale; }
  /// The one distance that all others are multiples of.
  [[nodiscard]] float unit(float times = 1) const noexcept { return 8 * times * scale; }
  [[nodiscard]] ImU32 mode_colour(Mode mode) const noexcept;
};

/// Hands colours and measures to Dear ImGui's own widgets.
void apply_style(const Theme& theme);

/// A colour as drawn now: paler inside what is greyed out. Everything drawn by hand passes through it.
[[nodiscard]] inline ImU32 ink(ImU32 colour) {
  return ImGui::GetColorU32(colour);
}

}  // namespace knuckle::console::widgets
