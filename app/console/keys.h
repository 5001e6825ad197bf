// The console's keys, once: what the window listens to and what the help shows. Codes are GLFW's, as its documentation
// lists them, so that this needs no window.
#pragma once

#include <array>
#include <cstdint>

namespace knuckle::console {

namespace key {
inline constexpr int kSpace = 32, kEscape = 256, kTab = 258, kBackspace = 259, kMinus = '-', kSlash = '/', kEqual = '=';
inline constexpr int kComma = ',', kPeriod = '.', kLeftBracket = '[', kRightBracket = ']', kPageUp = 266,
                     kPageDown = 267, kHome = 268, kEnd = 269;
inline constexpr int kF1 = 290, kF2 = 291, kF3 = 292, kF4 = 293, kF5 = 294, kF6 = 295, kF7 = 296;
inline constexpr int kF9 = 298, kF10 = 299, kF11 = 300, kF12 = 301;
inline constexpr int kKeypadSubtract = 333, kKeypadAdd = 334;
inline constexpr int kLeftShift = 340, kLeftControl = 341, kRightShift = 344, kRightControl = 345;
}  // namespace key

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
  kOperate,
  kLink,
  kRealTime,
  kHydraulics,
  kCalibration,
  kEvents,
  kHistory,
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
    KeyBinding{KeyAction::kEnable, key::kLeftShift, true, false, "Shift", "enable, for as long as it is held"},
    KeyBinding{KeyAction::kEnable, key::kRightShift, true, false, "", ""},
    KeyBinding{KeyAction::kBoomUp, 'Q', true, false, "Q", "boom up"},
    KeyBinding{KeyAction::kBoomDown, 'A', true, false, "A", "boom down"},
    KeyBinding{KeyAction::kArmOut, 'W', true, false, "W", "arm out"},
    KeyBinding{KeyAction::kArmIn, 'S', true, false, "S", "arm in"},
    KeyBinding{KeyAction::kBucketOut, 'E', true, false, "E", "bucket out"},
    KeyBinding{KeyAction::kBucketIn, 'D', true, false, "D", "bucket in (curl)"},
    KeyBinding{KeyAction::kSlow, key::kLeftControl, true, false, "Ctrl", "slow"},
    KeyBinding{KeyAction::kSlow, key::kRightControl, true, false, "", ""},
    KeyBinding{KeyAction::kClutch, 'C', true, false, "C", "clutch: the machine holds while the hand moves"},
    KeyBinding{KeyAction::kStop, key::kSpace, false, false, "Space", "Stop"},
    KeyBinding{KeyAction::kStop, key::kEscape, false, false, "Esc", "Stop, also while text is typed"},
    KeyBinding{KeyAction::kReleaseStop, key::kBackspace, false, true, "Ctrl+Backspace", "release Stop"},
    KeyBinding{KeyAction::kOperate, key::kF1, false, false, "F1", "Operate"},
    KeyBinding{KeyAction::kLink, key::kF2, false, false, "F2", "Link"},
    KeyBinding{KeyAction::kRealTime, key::kF3, false, false, "F3", "Real time"},
    KeyBinding{KeyAction::kHydraulics, key::kF4, false, false, "F4", "Hydraulics"},
    KeyBinding{KeyAction::kCalibration, key::kF5, false, false, "F5", "Calibration"},
    KeyBinding{KeyAction::kEvents, key::kF6, false, false, "F6", "Events"},
    KeyBinding{KeyAction::kHistory, key::kF7, false, false, "F7", "History"},
    KeyBinding{KeyAction::kPause, 'P', false, false, "P", "pause (simulation)"},
    KeyBinding{KeyAction::kReset, 'R', false, true, "Ctrl+R", "restart (simulation)"},
    KeyBinding{KeyAction::kBookmark, 'B', false, false, "B", "bookmark: an event, in the recording too"},
    KeyBinding{KeyAction::kHoldToRun, 'M', false, false, "M", "mouse or touch alone: enable while it is held"},
    KeyBinding{KeyAction::kGround, 'G', false, false, "G", "heights count from where the tip is now"},
    KeyBinding{KeyAction::kGradePoint, 'T', false, false, "T", "grade line through where the tip is now"},
    KeyBinding{KeyAction::kGradeSlope, 'Y', false, false, "Y", "its slope: from there to where the tip is now"},
    KeyBinding{KeyAction::kMute, 'N', false, false, "N", "alarm sounds off or on"},
    KeyBinding{KeyAction::kView, 'V', false, false, "V", "side view or orbit"},
    KeyBinding{KeyAction::kCloser, key::kPageUp, false, false, "Page up", "closer to the bucket's tip"},
    KeyBinding{KeyAction::kFarther, key::kPageDown, false, false, "Page down", "farther"},
    KeyBinding{KeyAction::kWhole, 'Z', false, false, "Z", "the whole machine in view"},
    KeyBinding{KeyAction::kPicture, 'X', false, false, "X", "large picture: each camera in turn, the machine"},
    KeyBinding{KeyAction::kAlign, 'K', false, false, "K", "align the large camera by clicking the tip"},
    KeyBinding{KeyAction::kEventBack, key::kLeftBracket, false, false, "[", "plots: to the event before"},
    KeyBinding{KeyAction::kEventOn, key::kRightBracket, false, false, "]", "plots: to the next event"},
    KeyBinding{KeyAction::kEnd, key::kEnd, false, false, "End", "plots: back to now"},
    KeyBinding{KeyAction::kTheme, key::kF9, false, false, "F9", "light or dark"},
    KeyBinding{KeyAction::kUnits, key::kF10, false, false, "F10", "metric or imperial"},
    KeyBinding{KeyAction::kFullScreen, key::kF11, false, false, "F11", "full screen"},
    KeyBinding{KeyAction::kLarger, key::kEqual, false, true, "Ctrl and +", "larger"},
    KeyBinding{KeyAction::kLarger, key::kKeypadAdd, false, true, "", ""},
    KeyBinding{KeyAction::kSmaller, key::kMinus, false, true, "Ctrl and -", "smaller"},
    KeyBinding{KeyAction::kSmaller, key::kKeypadSubtract, false, true, "", ""},
    // Not Shift for the way back: it enables.
    KeyBinding{KeyAction::kFocusOn, key::kTab, false, false, "Tab", "to the next button, slider, field or list"},
    KeyBinding{KeyAction::kFocusBack, key::kTab, false, true, "Ctrl+Tab", "to the one before"},
    KeyBinding{KeyAction::kHelp, key::kF12, false, false, "F12 or ?", "this help"},
    KeyBinding{KeyAction::kHelp, key::kSlash, false, false, "", ""},
};

/// While a recording is played, these; of the others those that act on the window alone.
inline constexpr std::array kPlayerKeys{
    KeyBinding{KeyAction::kPlay, key::kSpace, false, false, "Space", "play, pause"},
    KeyBinding{KeyAction::kStepBack, key::kComma, false, false, "Comma", "one cycle of a loop back"},
    KeyBinding{KeyAction::kStepOn, key::kPeriod, false, false, "Period", "one cycle of a loop on"},
    KeyBinding{KeyAction::kSecondBack, 'J', false, false, "J", "one second back"},
    KeyBinding{KeyAction::kSecondOn, 'L', false, false, "L", "one second on"},
    KeyBinding{KeyAction::kEventBack, key::kLeftBracket, false, false, "[", "to the event before"},
    KeyBinding{KeyAction::kEventOn, key::kRightBracket, false, false, "]", "to the next event"},
    KeyBinding{KeyAction::kSlower, key::kMinus, false, false, "-", "slower"},
    KeyBinding{KeyAction::kSlower, key::kKeypadSubtract, false, false, "", ""},
    KeyBinding{KeyAction::kFaster, key::kEqual, false, false, "+", "faster"},
    KeyBinding{KeyAction::kFaster, key::kKeypadAdd, false, false, "", ""},
    KeyBinding{KeyAction::kBegin, key::kHome, false, false, "Home", "to the beginning"},
    KeyBinding{KeyAction::kEnd, key::kEnd, false, false, "End", "to the end"},
};
[[nodiscard]] constexpr bool acts_on_window(const KeyBinding& binding) noexcept {
  return (binding.action >= KeyAction::kOperate && binding.action <= KeyAction::kHistory) ||
         (binding.action >= KeyAction::kView && binding.action <= KeyAction::kHelp) ||
         (binding.action >= KeyAction::kGround && binding.action <= KeyAction::kGradeSlope);
}

}  // namespace knuckle::console
