// The contact models beside the tip force, on the same known pulls.
#pragma once

#include <vector>

#include "app/studies/metrics.h"
#include "app/studies/offline_estimator.h"
#include "app/studies/trials.h"
#include "machine/description.h"

namespace knuckle::studies {

/// Metrics by model: tip_wrench, tip_force_of_two at the tip, force_and_position with the direction given. Of each,
/// answered (0 or 1: a pull may be refused) and those of its pulls (force_scores.h); of tip_wrench torque_Nm about the
/// tip, where there is none; of force_and_position place_error_m along the bucket.
/// @param machine as the estimator sees it; @param pulls its answers to trials.pulls.
[[nodiscard]] Row score_contact_models(const MachineDescription& machine, const Trials& trials,
                                       const std::vector<EstimateSample>& pulls);

}  // namespace knuckle::studies
