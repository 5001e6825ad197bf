#include "app/commissioning/ensemble.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/commissioning/parallel.h"
#include "app/commissioning/parameter_scores.h"
#include "core/error.h"

namespace knuckle::app {
namespace {

constexpr std::uint64_t kSeedsApart = 0x4000'0000'0000'0000;  // from those of machines that are judged

/// Identified minus true parameters of one drawn machine.
/// @throws std::runtime_error where it cannot be driven or identified.
CalibrationVector error_of(const MachineDescription& drawing, const CommissionPlan& plan, bool calibrate_geometry,
                           std::uint64_t seed) {
  const sim::MachineTruth truth = sim::draw_truth(drawing, seed);
  const CommissionRuns runs = run_commissioning(drawing, truth, plan, seed);
  const Commissioned found = calibrate(drawing, runs, {calibrate_geometry, {}});
  if (!found.full.summary.usable) throw std::runtime_error(found.full.summary.reasons.front());
  return found.full.dynamics.parameters -
         true_parameters(calibrated(found.machine), runs, found.full.dynamics, truth.hull_pitch_rad);
}

}  // namespace

CalibrationMatrix model_error(const MachineDescription& drawing, const CommissionPlan& plan, bool calibrate_geometry,
                              int machines, std::uint64_t seed, int jobs, const std::function<void(double)>& progress) {
  std::vector<std::optional<CalibrationVector>> errors(static_cast<std::size_t>(machines));
  std::vector<std::string> reasons(errors.size());
  parallel_for(
      errors.size(), jobs,
      [&](std::size_t i) {
        try {
          errors[i] = error_of(drawing, plan, calibrate_geometry, kSeedsApart + seed + i);
        } catch (const std::runtime_error& error) {
          reasons[i] = error.what();
        }
      },
      progress);
  CalibrationMatrix sum = CalibrationMatrix::Zero();
  int usable = 0;
  for (const auto& error : errors) {
    if (!error) continue;
    sum += *error * error->transpose();
    ++usable;
  }
  if (usable < 2) {
    const auto reason = std::find_if(reasons.begin(), reasons.end(), [](auto& text) { return !text.empty(); });
    throw InputError("ensemble: fewer than 2 of " + std::to_string(machines) + " machines were usable: " + *reason);
  }
  return sum / usable;
}

}  // namespace knuckle::app
