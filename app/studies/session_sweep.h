// Batteries of drawn sessions, on all processors, in shards and under MPI.
#pragma once

#include "app/studies/sweep_options.h"

namespace knuckle::studies {

/// @return the exit code: 0 where every session ran. Its figures are a judgement, not a test: no bound is applied.
int run_session_sweep(const SweepOptions& options);

}  // namespace knuckle::studies
