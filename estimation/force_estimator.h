// The force of the world on the bucket tip, from cylinder pressures: momentum observer on the nominal model minus
// friction ("dynamic tare"), with covariance, confidence and contact event. Runs in the slave loop.
#pragma once

#include <array>

#include "core/joints.h"
#include "core/time.h"
#include "estimation/joint_state.h"
#include "machine/description.h"

namespace knuckle::estimation {

/// Why the confidence is below 1 (bits).
enum ConfidenceReason : std::uint8_t {
  kStuckFriction = 1 << 0,  ///< at standstill friction hides force
  kNearSingular = 1 << 1,   ///< straight arm or bucket lever near its toggle
  kReliefOpen = 1 << 2,     ///< a relief valve limits what can be known
  kFastMotion = 1 << 3,
  kNotTared = 1 << 4,  ///< no free-motion adaptation yet
  kResidual = 1 << 5,  ///< three joints do not agree on one tip force: contact elsewhere or a sensor fault
};

struct ForceEstimate {
  JointVector joint_torque_Nm =
      JointVector::Zero();                           ///< External joint torque, observer at the force bandwidth (3 Hz).
  JointVector fast_torque_Nm = JointVector::Zero();  ///< Likewise at 6 Hz, for the slave's contact law.
  PlanarVector tip_N = PlanarVector::Zero();         ///< Force of the world on the tip, frame M.
  Eigen::Matrix2d covariance_N2 = Eigen::Matrix2d::Zero();
  double confidence = 0;  ///< [0, 1]
  std::uint8_t confidence_reasons = 0;
  double residual_sigma = 0;  ///< Left-over of the 3-joint fit, in standard deviations.
  bool contact = false;       ///< CUSUM contact event is on.
  int contact_joint = -1;     ///< Joint that saw it first.
};

}  // namespace knuckle::estimation
