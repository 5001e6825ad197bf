// The console's own widgets, each drawn into an area that the layout gave it.
#pragma once

#include <imgui.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/console/widgets/theme.h"
#include "app/console/widgets/units.h"

struct ImGuiWindow;

namespace knuckle::console {

// The console's icons, drawn as shapes: sharp at every scale, and no picture files to lose.

enum class Icon : std::uint8_t {
  kNone,
  kStop,  ///< Octagon
  kLink,
  kClock,
  kDrop,
  kWrench,
  kList,
  kWarning,  ///< Triangle with !
  kCheck,
  kLock,
  kPause,
  kPlay,
  kKeyboard,
  kGamepad,
  kArm,     ///< Excavator arm
  kDot,     ///< Filled circle
  kRing,    ///< Empty circle
  kCircle,  ///< Information: circle with i
  kHand,
  kReset,
  kStepBack,  ///< Triangle and bar
  kStepOn,
  kEventBack,  ///< Two triangles and bar
  kEventOn,
  kPlot,  ///< A line over axes
};

/// @param size edge of the square it fills, in screen pixels.
void draw_icon(ImDrawList& list, Icon icon, ImVec2 centre, float size, ImU32 colour);

// Which item has the keyboard. Tab goes through all items of a frame in the order in which they are drawn: Dear ImGui's
// own Tab knows only fields and sliders, changes them at once, and does not leave the list that it is in.

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

/// The loops update the view every few milliseconds: without an update for so long, they do not run.
inline constexpr double kLoopSilent_s = 0.2;

/// What every widget needs to know.
struct Ui {
  const Theme& theme;
  FocusOrder& focus;
  Units units;
  double now_s = 0;       ///< The window's clock; for flashing alone.
  double view_age_s = 0;  ///< Since the loops' last update.
  bool steady = false;    ///< Nothing flashes: for pictures.
  bool replay = false;    ///< A recording is shown: what is not there was not recorded.
  [[nodiscard]] bool loop_silent() const noexcept { return view_age_s > kLoopSilent_s; }
};

/// How old what is shown is, and how old it may be.
struct Freshness {
  bool heard = true;  ///< There was ever anything to show.
  double age_s = 0;
  double limit_s = 1e9;
  [[nodiscard]] bool stale() const noexcept { return !heard || age_s > limit_s; }
  /// So much later.
  [[nodiscard]] Freshness after(double seconds) const noexcept { return {heard, age_s + seconds, limit_s}; }
};

enum class Align : std::uint8_t { kLeft, kCentre, kRight };

// Text. Positions are of the text's middle line.
[[nodiscard]] float text_width(const ImFont* font, std::string_view text);
/// Of the text in lines of this width, broken at blanks.
[[nodiscard]] float text_height(const ImFont* font, float width, std::string_view text);
void put_text(const ImFont* font, ImU32 colour, ImVec2 at, Align align, std::string_view text);
/// On the area's middle line: at its left, its centre or its right.
void put_text(const ImFont* font, ImU32 colour, const Area& area, Align align, std::string_view text);
/// Small and muted, at the left of an area's middle line: what a value or a slider is called.
void put_label(const Theme& theme, const Area& area, std::string_view text);
/// Broken into lines at blanks; ends with "..." where the area has no room for all of them. @return the height used.
float put_lines(const ImFont* font, ImU32 colour, const Area& area, std::string_view text);
/// Ends with "..." where it would be wider.
[[nodiscard]] std::string fitted_text(const ImFont* font, float width, std::string_view text);
/// Ends with "..." where the area is too narrow.
void put_fitted(const ImFont* font, ImU32 colour, const Area& area, std::string_view text);

/// A titled box. What is in it is greyed, with its age beside the title, while it is stale; every screen shows data in
/// cards alone, so nothing old looks new.
class Card {
 public:
  Card(const Ui& ui, std::string_view title, const Area& area, Freshness freshness = {});
  ~Card();
  Card(const Card&) = delete;
  Card& operator=(const Card&) = delete;
  [[nodiscard]] const Area& inside() const noexcept { return inside_; }

 private:
  Area inside_;
  bool greyed_;
};

/// Label on the left, number in mono on the right, unit behind it.
void value_row(const Ui& ui, const Area& area, std::string_view label, std::string_view number, std::string_view unit);
/// Number and unit alone, on an area's middle line, large enough to be read from two metres.
void put_large(const Ui& ui, const Area& area, ImU32 colour, std::string_view number, std::string_view unit);
/// Lamp with its word: filled and coloured where on, an empty ring where off.
void lamp(const Ui& ui, const Area& area, std::string_view label, bool on, ImU32 colour);
/// Rounded tag with an icon. @return its width.
float chip(const Ui& ui, ImVec2 left_middle, Icon icon, std::string_view text, ImU32 fill);
[[nodiscard]] float chip_width(const Ui& ui, std::string_view text);
/// Horizontal bar from share_from to share_to of the area's width.
void bar(const Ui& ui, const Area& area, float share_from, float share_to, ImU32 colour);
/// Slanted lines across what is there: it is not known, or may be more. @param line_px of the design.
void hatch(const Ui& ui, const Area& area, ImU32 colour, float line_px);

/// The item made last can have the keyboard, and a ring around it while it has.
void focus_ring(const Ui& ui, const Area& area, float rounding);
/// An item for the pointer alone: the keyboard has other ways to do what it does, and passes it by.
void pointer_area(const char* id, const Area& area, ImGuiButtonFlags buttons = ImGuiButtonFlags_MouseButtonLeft);

// What can be operated. @return true in the frame it was.
bool button(const Ui& ui, const Area& area, Icon icon, const char* label, bool chosen = false, bool enabled = true);
struct SliderLook {
  const char* format = "%g";  ///< Of the value, which moves in steps of its last digit.
  float value_width = 0;      ///< Of the value's place beside the track, where the knob never covers it.
  bool locked = false, logarithmic = false;
  bool marked = false;  ///< The value stands out: it is not what is so.
};
bool slider(const Ui& ui, Area area, const char* id, float& value, float low, float high, const SliderLook& look);
bool toggle(const Ui& ui, const Area& area, const char* label, bool& value);
/// "< text >": steps through texts without a list that would cover anything.
bool stepper(const Ui& ui, const Area& area, const char* id, int& index, std::span<const std::string> texts);

}  // namespace knuckle::console
