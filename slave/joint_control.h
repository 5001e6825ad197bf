// Joint set-points to valve commands: the law that closes the loop through cylinders and valves.
#pragma once

#include <cstdint>

#include "core/joints.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "machine/description.h"

namespace knuckle::slave {

struct JointCommand {
  JointVector position_rad = JointVector::Zero(), velocity_radps = JointVector::Zero();
  bool active = false;  ///< false: neutral, and nothing is remembered.
};

class JointControl {
 public:
  /// @param step_s the fixed time between calls.
  JointControl(const MachineDescription& machine, double step_s);
  struct Output {
    JointVector valve = JointVector::Zero();       ///< [-1, 1], positive = extend.
    std::uint16_t limits = 0;                      ///< LimitFlag bits.
    JointVector rate_radps = JointVector::Zero();  ///< Joint rates asked of the valves.
  };
  /// @param sent_valve_last the commands that left the gate in the last step.
  Output step(const estimation::JointState& state, const estimation::ForceEstimate& force, const JointCommand& command,
              const JointVector& sent_valve_last) noexcept;
  void reset() noexcept;

 private:
  MachineDescription machine_;
};

}  // namespace knuckle::slave
