// What the person at the console asks for: from the window's thread to the loops', newest value only.
#pragma once

#include <cstdint>

#include "core/joints.h"
#include "core/time.h"
#include "transport/link_messages.h"

namespace knuckle::app {

/// How the hand is moved without a haptic device, by keyboard, mouse or gamepad.
struct HandInput {
  JointVector rate_radps = JointVector::Zero();  ///< Of the machine pose asked for.
  bool presence = false;                         ///< Somebody is there: any key or button of the hand is held.
  bool enable = false;                           ///< Dead-man.
  bool clutch = false;
};

struct ConsoleInput {
  Time at = kNever;   ///< When the window's thread last looked; too old, and nobody holds anything.
  HandInput hand;     ///< Without effect where a haptic device is in use.
  bool stop = false;  ///< Software stop is pressed in.
  double position_scale = 0, force_scale = 0;  ///< 0: as the device's file says. Taken while nothing is led.
  AssistSettings assist;
  bool paused = false;            ///< Simulated session only.
  std::uint32_t reset_count = 0;  ///< Counts up with every wish to begin the simulated session anew.
};

}  // namespace knuckle::app
