// Standard errors that hold: the error of an identified machine is mostly bias (pins, transmitters, oil, what the model
// leaves out), which no residual shows. It is taken from an ensemble of simulated machines of the same drawing, each
// commissioned and identified like the real one, and compared with what it really is.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "app/identify/commission.h"
#include "machine/calibration.h"
#include "machine/description.h"

namespace knuckle::identify {

// Many independent pieces of work on a few threads; the caller's thread watches and may end it.

/// Calls work(i) for every i < count, on `jobs` threads; 0: one a processor. @param progress called a few times a
/// second on this thread with the share done; what it throws, or work throws, ends the rest and is thrown on from here.
void parallel_for(std::size_t count, int jobs, const std::function<void(std::size_t)>& work,
                  const std::function<void(double)>& progress);

/// A machine that cannot be commissioned or identified does not count.
/// @param machines at least 2; @param seed samples them; none is the machine that sample_truth gives for a seed of the
/// same size. @param jobs threads; 0: one a processor. @param progress done share in [0, 1]; may throw to end it.
/// @return mean square error of the parameters over the machines, less what the recordings' own covariance accounts for
/// (which FullOptions::model_error is added to); positive semidefinite.
/// @throws InputError where fewer than 2 machines were usable.
[[nodiscard]] CalibrationMatrix model_error(const MachineDescription& nominal, const CommissionPlan& plan,
                                            bool calibrate_geometry, int machines, std::uint64_t seed, int jobs,
                                            const std::function<void(double)>& progress = {});

}  // namespace knuckle::identify
