// Keyboard, gamepad and mouse as hands: pure functions from what is held to the requested motion. No window here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/joints.h"
#include "core/time.h"
#include "machine/kinematics.h"
#include "transport/link_messages.h"

namespace knuckle::console {

// What the person at the console asks for: from the window's thread to the loops', newest value only.

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
  bool home = false;                           ///< The button for going home on two is held.
  double position_scale = 0, force_scale = 0;  ///< 0: as the device's file says. Taken while nothing is led.
  AssistSettings assist;
  double force_most_N = std::numeric_limits<double>::infinity();  ///< More on the tip is told as too much.
  bool paused = false;                                            ///< Simulated session only.
  std::uint32_t reset_count = 0;  ///< Counts up with every request to restart the simulated session.
};

/// What the person has in hand.
enum class HandSource : std::uint8_t { kKeyboard, kGamepad, kDevice };

/// Machine rates at a full key, stick or drag: about half of what one axis can do.
inline const JointVector kFullRate_radps{0.25, 0.35, 0.6};
inline constexpr double kSlowShare = 0.25;  ///< With the key for slow.

/// Keys that are held; keys.h says which.
struct HeldKeys {
  bool boom_up = false, boom_down = false, arm_out = false, arm_in = false, bucket_out = false, bucket_in = false;
  bool enable = false, clutch = false, slow = false;
};
/// Opposite keys cancel. Steps of rate: whoever moves the hand rounds them off (PersonHand).
[[nodiscard]] HandInput hand_from_keys(const HeldKeys& keys) noexcept;

/// What a gamepad reports: GLFW's GLFWgamepadstate, with its order of buttons and axes. Sticks in [-1, 1], right and
/// down positive.
struct GamepadState {
  enum Button : std::size_t { kA, kB, kX, kY, kLeftBumper, kRightBumper, kButtons = 15 };
  enum Axis : std::size_t { kLeftX, kLeftY, kRightX, kRightY, kLeftTrigger, kRightTrigger, kAxes };
  std::array<unsigned char, kButtons> buttons{};  ///< Not zero: pressed.
  std::array<float, kAxes> axes{};
};
struct GamepadHand {
  HandInput hand;
  bool stop = false;  ///< B is pressed; the window latches it.
};
inline constexpr double kStickDeadZone = 0.15;
/// As on excavators (ISO 10968): right stick back = boom up, right = bucket out; left stick forward = arm out.
/// Right bumper = enable, left bumper = clutch.
[[nodiscard]] GamepadHand hand_from_gamepad(const GamepadState& state) noexcept;
/// Deflection of a stick as a share of full rate: nothing within the dead zone, fine near it, 1 at the end.
[[nodiscard]] double stick_share(double deflection) noexcept;

/// A drag in the side view: the tip is pulled towards the mouse, the bucket keeps its angle to the ground.
/// @param drag_m from the requested tip to the mouse, machine metres, frame M. @param joint_rad requested machine pose.
/// Presence; enable and clutch are keys.
[[nodiscard]] HandInput hand_from_drag(const PlanarVector& drag_m, const JointVector& joint_rad,
                                       const Kinematics& kinematics) noexcept;

/// Two hands at once: rates add up to no more than full rate, what either holds is held.
[[nodiscard]] HandInput together(const HandInput& a, const HandInput& b) noexcept;

}  // namespace knuckle::console
