// What the person at the console asks for: from the window's thread to the loops', newest value only.
#pragma once

#include <cstdint>
#include <limits>

#include "core/joints.h"
#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle::console {

/// How the hand is moved without a haptic device, by keyboard, mouse or gamepad.
struct HandInput {
  JointVector rate_radps = JointVector::Zero();  ///< Of the requested machine pose.
  bool presence = false;                         ///< A person is there: any key or button of the hand is held.
  bool enable = false;                           ///< Dead-man.
  bool clutch = false;
};

/// Input older than this counts as released, a haptic device's included: who cannot see, nor press Stop,
/// leads nothing.
inline constexpr Duration kInputAgeLimit = 400ms;

/// Bounds of the scales; a request beyond them is taken as the bound. Both together are bounded as well: the force
/// scale gives way where the hand's spring would be too stiff (MasterLoop::kStiffest).
inline constexpr double kLeastPositionScale = 2, kMostPositionScale = 20;            ///< Machine m per hand m.
inline constexpr double kLeastForceScale = 1.0 / 8000, kMostForceScale = 1.0 / 500;  ///< Hand N per machine N.

struct ConsoleInput {
  Time at = kNever;  ///< When the window's thread last looked.
  /// The window is in front of the person: it has the keyboard and is not iconified. While it is not, a gamepad or a
  /// haptic device still moves, but its person looks elsewhere and Stop's key goes elsewhere: inputs count as released.
  bool attended = false;
  bool too_small = false;                      ///< The window has no room for any screen: likewise.
  HandInput hand;                              ///< Without effect where a haptic device is in use.
  bool stop = false;                           ///< Software stop is pressed in; acts attended or not.
  double position_scale = 0, force_scale = 0;  ///< 0: as the device's file says. Taken while nothing is led.
  AssistSettings assist;
  double force_most_N = std::numeric_limits<double>::infinity();  ///< More on the tip is told as too much.
  bool paused = false;                                            ///< Simulated session only.
  std::uint32_t reset_count = 0;  ///< Counts up with every request to restart the simulated session.
};

}  // namespace knuckle::console
