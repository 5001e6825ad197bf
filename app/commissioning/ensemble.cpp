#include "app/commissioning/ensemble.h"

#include <vector>

#include "app/commissioning/parallel.h"
#include "app/commissioning/parameter_scores.h"
#include "core/error.h"

namespace knuckle::app {

CalibrationMatrix model_error(const MachineDescription& drawing, const CommissionPlan& plan, bool calibrate_geometry,
                              int machines, std::uint64_t seed, int jobs, const std::function<void(double)>& progress) {
  std::vector<std::optional<CalibrationVector>> errors(static_cast<std::size_t>(machines));
  parallel_for(
      errors.size(), jobs,
      [&](std::size_t i) {
        const std::uint64_t own = seed + i;
        const sim::MachineTruth truth = sim::draw_truth(drawing, own);
        const CommissionRuns runs = run_commissioning(drawing, truth, plan, own);
        const Commissioned found = calibrate(drawing, runs, {calibrate_geometry, {}});
        if (!found.full.summary.usable) return;
        errors[i] = found.full.dynamics.parameters -
                    true_parameters(calibrated(found.machine), runs, found.full.dynamics, truth.hull_pitch_rad);
      },
      progress);
  CalibrationMatrix sum = CalibrationMatrix::Zero();
  int usable = 0;
  for (const auto& error : errors) {
    if (!error) continue;
    sum += *error * error->transpose();
    ++usable;
  }
  if (usable < 2) throw InputError("ensemble: fewer than 2 of " + std::to_string(machines) + " machines were usable");
  return sum / usable;
}

}  // namespace knuckle::app
