#include "app/studies/commission_scores.h"

#include <algorithm>
#include <cmath>

#include "machine/kinematics.h"

namespace knuckle::studies {
namespace {

JointVector lever_error(const MachineDescription& machine, MachineDescription truth) {
  // The true linkage may need a little more stroke than the drawing's cylinder has.
  constexpr double kRoom_m = 0.01;
  for (CylinderDescription& cylinder : truth.cylinders) {
    cylinder.min_length_m -= kRoom_m;
    cylinder.max_length_m += kRoom_m;
  }
  constexpr int kSteps = 40;
  const Kinematics kinematics(machine), true_kinematics(truth);
  JointVector relative;
  for (int joint = 0; joint < kJoints; ++joint) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
    double errors = 0, squares = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double angle = link.min_rad + (link.max_rad - link.min_rad) * i / kSteps;
      const auto model = kinematics.cylinder_at(joint, angle), real = true_kinematics.cylinder_at(joint, angle);
      if (!model || !real) continue;
      errors += std::pow(model->lever_m - real->lever_m, 2);
      squares += std::pow(real->lever_m, 2);
    }
    relative[joint] = std::sqrt(errors / squares);
  }
  return relative;
}

}  // namespace

CommissionScores score_commissioning(const MachineDescription& nominal, const identify::Commissioned& found,
                                     const sim::MachineTruth& truth) {
  CommissionScores scores;
  scores.tip_median_m = found.geometry.held_out.median_m;
  scores.nominal_tip_median_m = found.geometry.nominal.median_m;
  scores.lever = lever_error(calibrated(found.machine), truth.machine);
  scores.nominal_lever = lever_error(nominal, truth.machine);
  for (std::size_t i = 0; i < kJoints; ++i) {
    const ValveCalibration& valve = found.valves.valves[i];
    const ValveDescription& real = truth.machine.cylinders[i].valve;
    scores.dead_band = std::max({scores.dead_band, std::abs(valve.dead_band_extend - real.dead_band_extend),
                                 std::abs(valve.dead_band_retract - real.dead_band_retract)});
    scores.delay_s = std::max(scores.delay_s, std::abs(valve.delay_s - real.delay_s));
    scores.flow = std::max(scores.flow, std::abs(valve.nominal_flow_m3ps / real.nominal_flow_m3ps - 1));
  }
  return scores;
}

}  // namespace knuckle::studies
