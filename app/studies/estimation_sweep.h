// Many sampled machines, each commissioned, identified and judged by what its force estimate is worth.
#pragma once

#include "app/studies/sweep_options.h"

namespace knuckle::studies {

/// @return the exit code: 1 where a machine failed or a target was missed.
int run_estimation_sweep(const SweepOptions& options);

}  // namespace knuckle::studies
