// How near the calibrated geometry and valves are to the simulated machine's.
#pragma once

#include "app/identify/commission.h"
#include "sim/truth.h"

namespace knuckle::studies {

struct CommissionScores {
  double tip_median_m = 0, nominal_tip_median_m = 0;  ///< Held-out surveyed poses, the surveyor's error included.
  JointVector lever = JointVector::Zero();            ///< RMS error of dL/dtheta over the working range / its RMS
  JointVector nominal_lever = JointVector::Zero();
  double dead_band = 0;  ///< Worst of six, fraction of spool stroke.
  double delay_s = 0;    ///< Worst of three.
  double flow = 0;       ///< Worst of three, relative.
};

[[nodiscard]] CommissionScores score_commissioning(const MachineDescription& nominal,
                                                   const identify::Commissioned& found, const sim::MachineTruth& truth);

}  // namespace knuckle::studies
