// The console's keys, once: what the window listens to and what the help shows. GLFW's code of a letter is the letter.
#pragma once

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <array>
#include <cstdint>

#include "app/console/hand_input.h"

namespace knuckle::console {

/// In the order of the rail and of their keys, from F1 on. One more: here, its key below, and its row in screens.h.
enum class Screen : std::uint8_t { kOperate, kLink, kRealTime, kHydraulics, kCalibration, kEvents, kHistory, kCount };

enum class KeyAction : std::uint8_t {
  kHeld,  ///< For as long as it is down.
  kStop,
  kReleaseStop,
  kScreen,
  kPause,
  kReset,
  kBookmark,
  kHoldToRun,
  kGround,
  kGradePoint,
  kGradeSlope,
  kMute,
  kView,
  kCloser,
  kFarther,
  kWhole,
  kPicture,
  kAlign,
  kTheme,
  kUnits,
  kFullScreen,
  kLarger,
  kSmaller,
  kFocusOn,
  kFocusBack,
  kHelp,
  // the time that plots show
  kEventBack,
  kEventOn,
  kEnd,
  // the same, while a recording is played
  kPlay,
  kStepBack,
  kStepOn,
  kSecondBack,
  kSecondOn,
  kSlower,
  kFaster,
  kBegin,
};

struct KeyBinding {
  KeyAction action;
  int key;
  bool HeldKeys::*held;  ///< What it does for as long as it is down, whatever else is down; nullptr: it is pressed.
  bool control;          ///< Pressed ones: together with Ctrl, and only so; Stop whatever is held. Shift never counts.
  const char* keys;      ///< For the help; empty: another key of the line before.
  const char* what;
};

inline constexpr std::array kKeys{
    KeyBinding{KeyAction::kHeld, GLFW_KEY_LEFT_SHIFT, &HeldKeys::enable, false, "Shift",
               "enable, for as long as it is held"},
    KeyBinding{KeyAction::kHeld, GLFW_KEY_RIGHT_SHIFT, &HeldKeys::enable, false, "", ""},
    KeyBinding{KeyAction::kHeld, 'Q', &HeldKeys::boom_up, false, "Q", "boom up"},
    KeyBinding{KeyAction::kHeld, 'A', &HeldKeys::boom_down, false, "A", "boom down"},
    KeyBinding{KeyAction::kHeld, 'W', &HeldKeys::arm_out, false, "W", "arm out"},
    KeyBinding{KeyAction::kHeld, 'S', &HeldKeys::arm_in, false, "S", "arm in"},
    KeyBinding{KeyAction::kHeld, 'E', &HeldKeys::bucket_out, false, "E", "bucket out"},
    KeyBinding{KeyAction::kHeld, 'D', &HeldKeys::bucket_in, false, "D", "bucket in (curl)"},
    KeyBinding{KeyAction::kHeld, GLFW_KEY_LEFT_CONTROL, &HeldKeys::slow, false, "Ctrl", "slow"},
    KeyBinding{KeyAction::kHeld, GLFW_KEY_RIGHT_CONTROL, &HeldKeys::slow, false, "", ""},
    KeyBinding{KeyAction::kHeld, 'C', &HeldKeys::clutch, false, "C", "clutch: the machine holds while the hand moves"},
    KeyBinding{KeyAction::kStop, GLFW_KEY_SPACE, nullptr, false, "Space", "Stop"},
    KeyBinding{KeyAction::kStop, GLFW_KEY_ESCAPE, nullptr, false, "Esc", "Stop, also while text is typed"},
    KeyBinding{KeyAction::kReleaseStop, GLFW_KEY_BACKSPACE, nullptr, true, "Ctrl+Backspace", "release Stop"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F1, nullptr, false, "F1", "Operate"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F2, nullptr, false, "F2", "Link"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F3, nullptr, false, "F3", "Real time"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F4, nullptr, false, "F4", "Hydraulics"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F5, nullptr, false, "F5", "Calibration"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F6, nullptr, false, "F6", "Events"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F7, nullptr, false, "F7", "History"},
    KeyBinding{KeyAction::kPause, 'P', nullptr, false, "P", "pause (simulation)"},
    KeyBinding{KeyAction::kReset, 'R', nullptr, true, "Ctrl+R", "restart (simulation)"},
    KeyBinding{KeyAction::kBookmark, 'B', nullptr, false, "B", "bookmark: an event, in the recording too"},
    KeyBinding{KeyAction::kHoldToRun, 'M', nullptr, false, "M", "mouse or touch alone: enable while it is held"},
    KeyBinding{KeyAction::kGround, 'G', nullptr, false, "G", "heights count from where the tip is now"},
    KeyBinding{KeyAction::kGradePoint, 'T', nullptr, false, "T", "grade line through where the tip is now"},
    KeyBinding{KeyAction::kGradeSlope, 'Y', nullptr, false, "Y", "its slope: from there to where the tip is now"},
    KeyBinding{KeyAction::kMute, 'N', nullptr, false, "N", "alarm sounds off or on"},
    KeyBinding{KeyAction::kView, 'V', nullptr, false, "V", "side view or orbit"},
    KeyBinding{KeyAction::kCloser, GLFW_KEY_PAGE_UP, nullptr, false, "Page up", "closer to the bucket's tip"},
    KeyBinding{KeyAction::kFarther, GLFW_KEY_PAGE_DOWN, nullptr, false, "Page down", "farther"},
    KeyBinding{KeyAction::kWhole, 'Z', nullptr, false, "Z", "the whole machine in view"},
    KeyBinding{KeyAction::kPicture, 'X', nullptr, false, "X", "large picture: each camera in turn, the machine"},
    KeyBinding{KeyAction::kAlign, 'K', nullptr, false, "K", "align the large camera by clicking the tip"},
    KeyBinding{KeyAction::kEventBack, GLFW_KEY_LEFT_BRACKET, nullptr, false, "[", "plots: to the event before"},
    KeyBinding{KeyAction::kEventOn, GLFW_KEY_RIGHT_BRACKET, nullptr, false, "]", "plots: to the next event"},
    KeyBinding{KeyAction::kEnd, GLFW_KEY_END, nullptr, false, "End", "plots: back to now"},
    KeyBinding{KeyAction::kTheme, GLFW_KEY_F9, nullptr, false, "F9", "light or dark"},
    KeyBinding{KeyAction::kUnits, GLFW_KEY_F10, nullptr, false, "F10", "metric or imperial"},
    KeyBinding{KeyAction::kFullScreen, GLFW_KEY_F11, nullptr, false, "F11", "full screen"},
    KeyBinding{KeyAction::kLarger, GLFW_KEY_EQUAL, nullptr, true, "Ctrl and +", "larger"},
    KeyBinding{KeyAction::kLarger, GLFW_KEY_KP_ADD, nullptr, true, "", ""},
    KeyBinding{KeyAction::kSmaller, GLFW_KEY_MINUS, nullptr, true, "Ctrl and -", "smaller"},
    KeyBinding{KeyAction::kSmaller, GLFW_KEY_KP_SUBTRACT, nullptr, true, "", ""},
    // Not Shift for the way back: it enables.
    KeyBinding{KeyAction::kFocusOn, GLFW_KEY_TAB, nullptr, false, "Tab", "to the next button, slider, field or list"},
    KeyBinding{KeyAction::kFocusBack, GLFW_KEY_TAB, nullptr, true, "Ctrl+Tab", "to the one before"},
    KeyBinding{KeyAction::kHelp, GLFW_KEY_F12, nullptr, false, "F12 or ?", "this help"},
    KeyBinding{KeyAction::kHelp, GLFW_KEY_SLASH, nullptr, false, "", ""},
};

/// Which one a key of kScreen opens.
[[nodiscard]] constexpr Screen screen_of(const KeyBinding& binding) noexcept {
  return static_cast<Screen>(binding.key - GLFW_KEY_F1);
}
/// And its name is what the key does.
[[nodiscard]] constexpr const KeyBinding& key_of(Screen screen) noexcept {
  const KeyBinding* at = kKeys.data();
  while (at->action != KeyAction::kScreen || screen_of(*at) != screen) ++at;
  return *at;
}
static_assert(key_of(static_cast<Screen>(static_cast<int>(Screen::kCount) - 1)).held == nullptr, "each screen has one");

/// While a recording is played, these; of the others those that act on the window alone.
inline constexpr std::array kPlayerKeys{
    KeyBinding{KeyAction::kPlay, GLFW_KEY_SPACE, nullptr, false, "Space", "play, pause"},
    KeyBinding{KeyAction::kStepBack, GLFW_KEY_COMMA, nullptr, false, "Comma", "one cycle of a loop back"},
    KeyBinding{KeyAction::kStepOn, GLFW_KEY_PERIOD, nullptr, false, "Period", "one cycle of a loop on"},
    KeyBinding{KeyAction::kSecondBack, 'J', nullptr, false, "J", "one second back"},
    KeyBinding{KeyAction::kSecondOn, 'L', nullptr, false, "L", "one second on"},
    KeyBinding{KeyAction::kEventBack, GLFW_KEY_LEFT_BRACKET, nullptr, false, "[", "to the event before"},
    KeyBinding{KeyAction::kEventOn, GLFW_KEY_RIGHT_BRACKET, nullptr, false, "]", "to the next event"},
    KeyBinding{KeyAction::kSlower, GLFW_KEY_MINUS, nullptr, false, "-", "slower"},
    KeyBinding{KeyAction::kSlower, GLFW_KEY_KP_SUBTRACT, nullptr, false, "", ""},
    KeyBinding{KeyAction::kFaster, GLFW_KEY_EQUAL, nullptr, false, "+", "faster"},
    KeyBinding{KeyAction::kFaster, GLFW_KEY_KP_ADD, nullptr, false, "", ""},
    KeyBinding{KeyAction::kBegin, GLFW_KEY_HOME, nullptr, false, "Home", "to the beginning"},
    KeyBinding{KeyAction::kEnd, GLFW_KEY_END, nullptr, false, "End", "to the end"},
};
[[nodiscard]] constexpr bool acts_on_window(const KeyBinding& binding) noexcept {
  return binding.action == KeyAction::kScreen ||
         (binding.action >= KeyAction::kView && binding.action <= KeyAction::kHelp) ||
         (binding.action >= KeyAction::kGround && binding.action <= KeyAction::kGradeSlope);
}

}  // namespace knuckle::console
