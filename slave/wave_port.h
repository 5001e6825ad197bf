// The machine's end of the wave variables: the arriving wave and the estimated force make the set-point's speed at the
// tip, and the wave that returns.
#pragma once

#include "core/joints.h"
#include "core/time.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "transport/link_messages.h"
#include "transport/wave_line.h"

namespace knuckle::slave {

/// With u the wave that arrives, f the force of the tip on the world, b the impedance that the operator's side sends:
///   v = (sqrt(2 b) u - f) / b,   w = u - sqrt(2 / b) f,   f v = (u^2 - w^2) / 2
/// (Niemeyer and Slotine 1991). q_ref follows v at the tip, and the operator in what does not move the tip:
///   dq_ref = dq_op + J^+ (v - J dq_op) + kDrift (q_op - q_ref)
/// The last term keeps the positions together. It is no wave: it moves the set-point against the force only as far as
/// the energy that the smoothing of the wave took out pays for it. Without waves (`cues`) it alone moves the tip after
/// the operator, late, and not into what holds it back. q_ref goes no further away from q_op than 5 deg and leaves no
/// joint's range: such a bound stops q_ref, and moves it never. Passive between (V, F) at the hand and (set-point
/// speed, estimated force) here. Valve and observer lie beyond: the arm follows the set-point 0.1 to 0.2 s late and the
/// estimate is as late again, so with a stiff wall what lies beyond is not passive at frequencies of some hertz. No
/// wave can mend that.
class WavePort {
 public:
  struct Reference {
    JointVector position_rad, velocity_radps;
  };
  WavePort(const MachineDescription& machine, double step_s);

  /// @param asked the set-point without waves. @param message what the operator's side sent last.
  /// @return what to follow instead; `asked` itself where the operator's side sends no waves, or not `led`.
  [[nodiscard]] Reference step(const Reference& asked, const MasterMessage& message, const JointVector& measured_rad,
                               const PlanarVector& world_N, bool led, Time now) noexcept;
  [[nodiscard]] const Wave& returning() const noexcept { return returning_; }
  /// Energy that has arrived and neither gone to the world nor returned.
  [[nodiscard]] double kept_J() const noexcept { return kept_J_; }

 private:
  Kinematics kinematics_;
  JointVector low_rad_, high_rad_, weight_;
  double most_mps_, step_s_;
  WaveReceiver arriving_;
  Wave returning_;
  bool running_ = false;
  double kept_J_ = 0;
  JointVector reference_rad_ = JointVector::Zero();
};

}  // namespace knuckle::slave
