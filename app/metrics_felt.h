// The part of the metrics that the operator's hand would name: contact kept, rise, settling, hold, drag, slew.
#pragma once

#include "app/metrics.h"

namespace knuckle::app {

/// Fills the `felt` group of `metrics`.
void measure_felt(const SessionRecord& record, Metrics& metrics);

}  // namespace knuckle::app
