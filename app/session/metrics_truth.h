// The part of the metrics that asks, over the whole session, whether the hand was told the truth.
#pragma once

#include "app/session/metrics.h"

namespace knuckle::session {

/// Fills those of the `felt` and `force` groups that compare what is felt with what is true while engaged.
/// @param free rows of free motion.
void measure_truth(const SessionRecord& record, const std::vector<bool>& free, Metrics& metrics);

}  // namespace knuckle::session
