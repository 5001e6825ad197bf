// From raw machine signals to what controller and estimators work with: angles, rates, levers, cylinder forces.
#pragma once

#include <array>
#include <optional>

#include "core/joints.h"
#include "machine/arm_description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// One synchronous set of sensor values, SI, as the sensors say (not yet filtered).
struct Measurement {
  std::array<double, 6> pressure_Pa{};           ///< boom A, B, arm A, B, bucket A, B
  JointVector cylinder_m = JointVector::Zero();  ///< Pin-to-pin lengths from the wire encoders.
  double hull_pitch_rad = 0;                     ///< M's x axis above the horizontal (counter-clockwise).
  /// false: nobody measures this cylinder's pressures; what stands for them above means nothing.
  PerJoint<bool> pressures_known{true, true, true};
};

struct JointState {
  JointVector angle_rad = JointVector::Zero();
  JointVector rate_radps = JointVector::Zero();    ///< Low-passed derivative.
  JointVector lever_m = JointVector::Zero();       ///< dL/dtheta
  JointVector cylinder_mps = JointVector::Zero();  ///< Extension rate, low-passed.
  JointVector cylinder_N = JointVector::Zero();    ///< p_A A_A - p_B A_B
  std::array<double, 6> pressure_Pa{};
  double hull_pitch_rad = 0;
  PerJoint<bool> pressures_known{true, true, true};  ///< As in Measurement; where not, force and pressures are 0.

  /// p_A + p_B of each cylinder.
  [[nodiscard]] JointVector pressure_sum_Pa() const noexcept {
    const auto& p = pressure_Pa;
    return {p[0] + p[1], p[2] + p[3], p[4] + p[5]};
  }
};

class JointStateFilter {
 public:
  /// @param step_s the fixed time between calls; @param velocity_cutoff_Hz of the rates.
  JointStateFilter(const MachineDescription& machine, double step_s, double velocity_cutoff_Hz);
  /// @return nullopt where a value is non-finite or a length has no joint angle. The first valid call starts at rest.
  std::optional<JointState> step(const Measurement& measurement) noexcept;
  void reset() noexcept { started_ = false; }

 private:
  PerJoint<CylinderDescription> cylinders_;
  Kinematics kinematics_;
  double step_s_, blend_;
  bool started_ = false;
  JointVector last_cylinder_m_ = JointVector::Zero();
  JointVector cylinder_mps_ = JointVector::Zero();
};

}  // namespace knuckle::estimation
