// The contact models beside the tip force, on the same known pulls.
#pragma once

#include <vector>

#include "app/studies/force_scores.h"
#include "app/studies/offline_estimator.h"
#include "app/studies/trials.h"
#include "machine/description.h"

namespace knuckle::studies {

/// tip_wrench, tip_force_of_two at the tip, force_and_position with the direction given.
/// @param machine as the estimator sees it; @param pulls its answers to trials.pulls.
[[nodiscard]] std::vector<ContactModelScore> score_contact_models(const MachineDescription& machine,
                                                                  const Trials& trials,
                                                                  const std::vector<EstimateSample>& pulls);

}  // namespace knuckle::studies
