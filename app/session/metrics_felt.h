// The part of the metrics that the operator's hand would name: contact kept, rise, settling, hold, drag, slew.
#pragma once

#include "app/session/metrics.h"

namespace knuckle::session {

/// Fills the `felt` group of `metrics`.
void measure_felt(const SessionRecord& record, Metrics& metrics);

}  // namespace knuckle::session
