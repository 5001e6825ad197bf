// How near the calibrated geometry and valves are to the simulated machine's.
#pragma once

#include "app/identify/commission.h"
#include "app/studies/metrics.h"
#include "sim/truth.h"

namespace knuckle::studies {

/// tip_median_m and nominal_tip_median_m: held-out surveyed poses, the surveyor's error included. lever.JOINT and
/// nominal_lever.JOINT: RMS error of dL/dtheta over the working range / its RMS. dead_band: worst of six, fraction of
/// spool stroke. delay_s, flow: worst of three, the flow's relative.
[[nodiscard]] Row score_commissioning(const MachineDescription& nominal, const identify::Commissioned& found,
                                      const sim::MachineTruth& truth);

}  // namespace knuckle::studies
