// Keyboard, gamepad and mouse as hands: pure functions from what is held to the requested motion. No window here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "app/console/console_input.h"
#include "core/joints.h"
#include "machine/kinematics.h"

namespace knuckle::console {

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
