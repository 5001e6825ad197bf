// The part of the metrics that asks, over the whole session, whether the hand was told the truth.
#pragma once

#include "app/session/metrics.h"

namespace knuckle::session {

/// Fills those of the `felt` and `force` groups that compare what is felt with what is true while engaged.
void measure_truth(const SessionRecord& record, Metrics& metrics);

}  // namespace knuckle::session
