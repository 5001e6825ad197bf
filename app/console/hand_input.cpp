#include "app/console/hand_input.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace knuckle::console {
namespace {

constexpr double kExpo = 0.6;             // share of the cube in a stick's curve: fine near the middle
constexpr double kDragGain_1ps = 2;       // tip speed per metre of drag
constexpr double kFastestDrag_mps = 0.6;  // of the tip
constexpr double kDragDamping_m2 = 0.02;  // near a straight arm the tip cannot go along it: no joint races there
constexpr double kFingerOnStick = 1e-9;   // beyond the dead zone

double direction(bool forward, bool backward) noexcept {
  return (forward ? 1.0 : 0.0) - (backward ? 1.0 : 0.0);
}

/// The same direction of motion, no joint above its full rate.
JointVector within_full_rate(const JointVector& rate_radps) noexcept {
  const double most = rate_radps.cwiseQuotient(kFullRate_radps).cwiseAbs().maxCoeff();
  return most > 1 ? JointVector(rate_radps / most) : rate_radps;
}

}  // namespace

HandInput hand_from_keys(const HeldKeys& keys) noexcept {
  const JointVector wanted{direction(keys.boom_up, keys.boom_down), direction(keys.arm_out, keys.arm_in),
                           direction(keys.bucket_out, keys.bucket_in)};
  HandInput hand;
  hand.rate_radps = (keys.slow ? kSlowShare : 1.0) * kFullRate_radps.cwiseProduct(wanted);
  hand.enable = keys.enable;
  hand.clutch = keys.clutch;
  hand.presence = keys.boom_up || keys.boom_down || keys.arm_out || keys.arm_in || keys.bucket_out || keys.bucket_in ||
                  keys.enable || keys.clutch;
  return hand;
}

double stick_share(double deflection) noexcept {
  if (!std::isfinite(deflection)) return 0;
  const double beyond = (std::min(std::abs(deflection), 1.0) - kStickDeadZone) / (1 - kStickDeadZone);
  if (beyond <= 0) return 0;
  return std::copysign((1 - kExpo) * beyond + kExpo * beyond * beyond * beyond, deflection);
}

GamepadHand hand_from_gamepad(const GamepadState& state) noexcept {
  const auto share = [&state](GamepadState::Axis axis) { return stick_share(double{state.axes[axis]}); };
  const auto pressed = [&state](GamepadState::Button button) { return state.buttons[button] != 0; };
  const JointVector wanted{share(GamepadState::kRightY), -share(GamepadState::kLeftY), share(GamepadState::kRightX)};
  GamepadHand pad;
  pad.hand.rate_radps = kFullRate_radps.cwiseProduct(wanted);
  pad.hand.enable = pressed(GamepadState::kRightBumper);
  pad.hand.clutch = pressed(GamepadState::kLeftBumper);
  pad.hand.presence = pad.hand.enable || pad.hand.clutch || wanted.cwiseAbs().maxCoeff() > kFingerOnStick;
  pad.stop = pressed(GamepadState::kB);
  return pad;
}

HandInput hand_from_drag(const PlanarVector& drag_m, const JointVector& joint_rad,
                         const Kinematics& kinematics) noexcept {
  HandInput hand;
  if (!drag_m.allFinite()) return hand;
  hand.presence = true;
  PlanarVector tip_mps = kDragGain_1ps * drag_m;
  const double speed = tip_mps.norm();
  if (speed > kFastestDrag_mps) tip_mps *= kFastestDrag_mps / speed;
  // Rates r with J r = v and no change of the bucket's absolute angle (1 1 1) r = 0, least squares with damping.
  Eigen::Matrix3d rows;
  rows << kinematics.tip_jacobian(joint_rad), Eigen::RowVector3d::Ones();
  const Eigen::Vector3d asked{tip_mps.x(), tip_mps.y(), 0};
  const Eigen::Matrix3d normal = rows.transpose() * rows + kDragDamping_m2 * Eigen::Matrix3d::Identity();
  const JointVector rate_radps = normal.inverse() * (rows.transpose() * asked);
  if (rate_radps.allFinite()) hand.rate_radps = within_full_rate(rate_radps);
  return hand;
}

HandInput together(const HandInput& a, const HandInput& b) noexcept {
  return {within_full_rate(a.rate_radps + b.rate_radps), a.presence || b.presence, a.enable || b.enable,
          a.clutch || b.clutch};
}

}  // namespace knuckle::console
