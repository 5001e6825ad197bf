// The console's keys, once: what the window listens to and what the help shows. GLFW's code of a letter is the letter.
#pragma once

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <array>
#include <cstdint>

namespace knuckle::console {

/// In the order of the rail and of their keys, from F1 on. One more: here, its key below, and its row in screens.h.
enum class Screen : std::uint8_t { kOperate, kLink, kRealTime, kHydraulics, kCalibration, kEvents, kHistory, kCount };

enum class KeyAction : std::uint8_t {
  // held
  kEnable,
  kClutch,
  kSlow,
  kBoomUp,
  kBoomDown,
  kArmOut,
  kArmIn,
  kBucketOut,
  kBucketIn,
  // pressed
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
  // pressed: the time that plots show
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
  bool held;         ///< Acts for as long as it is down, whatever else is down.
  bool control;      ///< Pressed ones: together with Ctrl, and only so; Stop whatever is held. Shift never counts.
  const char* keys;  ///< For the help; empty: another key of the line before.
  const char* what;
};

inline constexpr std::array kKeys{
    KeyBinding{KeyAction::kEnable, GLFW_KEY_LEFT_SHIFT, true, false, "Shift", "enable, for as long as it is held"},
    KeyBinding{KeyAction::kEnable, GLFW_KEY_RIGHT_SHIFT, true, false, "", ""},
    KeyBinding{KeyAction::kBoomUp, 'Q', true, false, "Q", "boom up"},
    KeyBinding{KeyAction::kBoomDown, 'A', true, false, "A", "boom down"},
    KeyBinding{KeyAction::kArmOut, 'W', true, false, "W", "arm out"},
    KeyBinding{KeyAction::kArmIn, 'S', true, false, "S", "arm in"},
    KeyBinding{KeyAction::kBucketOut, 'E', true, false, "E", "bucket out"},
    KeyBinding{KeyAction::kBucketIn, 'D', true, false, "D", "bucket in (curl)"},
    KeyBinding{KeyAction::kSlow, GLFW_KEY_LEFT_CONTROL, true, false, "Ctrl", "slow"},
    KeyBinding{KeyAction::kSlow, GLFW_KEY_RIGHT_CONTROL, true, false, "", ""},
    KeyBinding{KeyAction::kClutch, 'C', true, false, "C", "clutch: the machine holds while the hand moves"},
    KeyBinding{KeyAction::kStop, GLFW_KEY_SPACE, false, false, "Space", "Stop"},
    KeyBinding{KeyAction::kStop, GLFW_KEY_ESCAPE, false, false, "Esc", "Stop, also while text is typed"},
    KeyBinding{KeyAction::kReleaseStop, GLFW_KEY_BACKSPACE, false, true, "Ctrl+Backspace", "release Stop"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F1, false, false, "F1", "Operate"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F2, false, false, "F2", "Link"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F3, false, false, "F3", "Real time"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F4, false, false, "F4", "Hydraulics"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F5, false, false, "F5", "Calibration"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F6, false, false, "F6", "Events"},
    KeyBinding{KeyAction::kScreen, GLFW_KEY_F7, false, false, "F7", "History"},
    KeyBinding{KeyAction::kPause, 'P', false, false, "P", "pause (simulation)"},
    KeyBinding{KeyAction::kReset, 'R', false, true, "Ctrl+R", "restart (simulation)"},
    KeyBinding{KeyAction::kBookmark, 'B', false, false, "B", "bookmark: an event, in the recording too"},
    KeyBinding{KeyAction::kHoldToRun, 'M', false, false, "M", "mouse or touch alone: enable while it is held"},
    KeyBinding{KeyAction::kGround, 'G', false, false, "G", "heights count from where the tip is now"},
    KeyBinding{KeyAction::kGradePoint, 'T', false, false, "T", "grade line through where the tip is now"},
    KeyBinding{KeyAction::kGradeSlope, 'Y', false, false, "Y", "its slope: from there to where the tip is now"},
    KeyBinding{KeyAction::kMute, 'N', false, false, "N", "alarm sounds off or on"},
    KeyBinding{KeyAction::kView, 'V', false, false, "V", "side view or orbit"},
    KeyBinding{KeyAction::kCloser, GLFW_KEY_PAGE_UP, false, false, "Page up", "closer to the bucket's tip"},
    KeyBinding{KeyAction::kFarther, GLFW_KEY_PAGE_DOWN, false, false, "Page down", "farther"},
    KeyBinding{KeyAction::kWhole, 'Z', false, false, "Z", "the whole machine in view"},
    KeyBinding{KeyAction::kPicture, 'X', false, false, "X", "large picture: each camera in turn, the machine"},
    KeyBinding{KeyAction::kAlign, 'K', false, false, "K", "align the large camera by clicking the tip"},
    KeyBinding{KeyAction::kEventBack, GLFW_KEY_LEFT_BRACKET, false, false, "[", "plots: to the event before"},
    KeyBinding{KeyAction::kEventOn, GLFW_KEY_RIGHT_BRACKET, false, false, "]", "plots: to the next event"},
    KeyBinding{KeyAction::kEnd, GLFW_KEY_END, false, false, "End", "plots: back to now"},
    KeyBinding{KeyAction::kTheme, GLFW_KEY_F9, false, false, "F9", "light or dark"},
    KeyBinding{KeyAction::kUnits, GLFW_KEY_F10, false, false, "F10", "metric or imperial"},
    KeyBinding{KeyAction::kFullScreen, GLFW_KEY_F11, false, false, "F11", "full screen"},
    KeyBinding{KeyAction::kLarger, GLFW_KEY_EQUAL, false, true, "Ctrl and +", "larger"},
    KeyBinding{KeyAction::kLarger, GLFW_KEY_KP_ADD, false, true, "", ""},
    KeyBinding{KeyAction::kSmaller, GLFW_KEY_MINUS, false, true, "Ctrl and -", "smaller"},
    KeyBinding{KeyAction::kSmaller, GLFW_KEY_KP_SUBTRACT, false, true, "", ""},
    // Not Shift for the way back: it enables.
    KeyBinding{KeyAction::kFocusOn, GLFW_KEY_TAB, false, false, "Tab", "to the next button, slider, field or list"},
    KeyBinding{KeyAction::kFocusBack, GLFW_KEY_TAB, false, true, "Ctrl+Tab", "to the one before"},
    KeyBinding{KeyAction::kHelp, GLFW_KEY_F12, false, false, "F12 or ?", "this help"},
    KeyBinding{KeyAction::kHelp, GLFW_KEY_SLASH, false, false, "", ""},
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
static_assert(!key_of(static_cast<Screen>(static_cast<int>(Screen::kCount) - 1)).held, "each screen has a key");

/// While a recording is played, these; of the others those that act on the window alone.
inline constexpr std::array kPlayerKeys{
    KeyBinding{KeyAction::kPlay, GLFW_KEY_SPACE, false, false, "Space", "play, pause"},
    KeyBinding{KeyAction::kStepBack, GLFW_KEY_COMMA, false, false, "Comma", "one cycle of a loop back"},
    KeyBinding{KeyAction::kStepOn, GLFW_KEY_PERIOD, false, false, "Period", "one cycle of a loop on"},
    KeyBinding{KeyAction::kSecondBack, 'J', false, false, "J", "one second back"},
    KeyBinding{KeyAction::kSecondOn, 'L', false, false, "L", "one second on"},
    KeyBinding{KeyAction::kEventBack, GLFW_KEY_LEFT_BRACKET, false, false, "[", "to the event before"},
    KeyBinding{KeyAction::kEventOn, GLFW_KEY_RIGHT_BRACKET, false, false, "]", "to the next event"},
    KeyBinding{KeyAction::kSlower, GLFW_KEY_MINUS, false, false, "-", "slower"},
    KeyBinding{KeyAction::kSlower, GLFW_KEY_KP_SUBTRACT, false, false, "", ""},
    KeyBinding{KeyAction::kFaster, GLFW_KEY_EQUAL, false, false, "+", "faster"},
    KeyBinding{KeyAction::kFaster, GLFW_KEY_KP_ADD, false, false, "", ""},
    KeyBinding{KeyAction::kBegin, GLFW_KEY_HOME, false, false, "Home", "to the beginning"},
    KeyBinding{KeyAction::kEnd, GLFW_KEY_END, false, false, "End", "to the end"},
};
[[nodiscard]] constexpr bool acts_on_window(const KeyBinding& binding) noexcept {
  return binding.action == KeyAction::kScreen ||
         (binding.action >= KeyAction::kView && binding.action <= KeyAction::kHelp) ||
         (binding.action >= KeyAction::kGround && binding.action <= KeyAction::kGradeSlope);
}

}  // namespace knuckle::console
