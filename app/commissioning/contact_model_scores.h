// The contact models beside the tip force, on the same known pulls.
#pragma once

#include <vector>

#include "app/commissioning/force_scores.h"
#include "app/commissioning/offline_estimator.h"
#include "app/commissioning/trials.h"
#include "machine/description.h"

namespace knuckle::app {

/// tip_wrench, tip_force_of_two at the tip, force_and_position with the direction given.
/// @param machine as the estimator sees it; @param pulls its answers to trials.pulls.
[[nodiscard]] std::vector<ContactModelScore> score_contact_models(const MachineDescription& machine,
                                                                  const Trials& trials,
                                                                  const std::vector<EstimateSample>& pulls);

}  // namespace knuckle::app
