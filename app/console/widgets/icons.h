// The console's icons, drawn as shapes: sharp at every scale, and no picture files to lose.
#pragma once

#include <imgui.h>

#include <cstdint>

namespace knuckle::console::widgets {

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

}  // namespace knuckle::console::widgets
