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

Row score_commissioning(const MachineDescription& nominal, const identify::Commissioned& found,
                        const sim::MachineTruth& truth) {
  double dead_band = 0, delay_s = 0, flow = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const ValveCalibration& valve = found.valves.valves[i];
    const ValveDescription& real = truth.machine.cylinders[i].valve;
    dead_band = std::max({dead_band, std::abs(valve.dead_band_extend - real.dead_band_extend),
                          std::abs(valve.dead_band_retract - real.dead_band_retract)});
    delay_s = std::max(delay_s, std::abs(valve.delay_s - real.delay_s));
    flow = std::max(flow, std::abs(valve.nominal_flow_m3ps / real.nominal_flow_m3ps - 1));
  }
  Row metrics{{"tip_median_m", metric(found.geometry.held_out.median_m)},
              {"nominal_tip_median_m", metric(found.geometry.nominal.median_m)},
              {"dead_band", metric(dead_band)},
              {"delay_s", metric(delay_s)},
              {"flow", metric(flow)}};
  add_joints(metrics, "lever", lever_error(calibrated(found.machine), truth.machine));
  add_joints(metrics, "nominal_lever", lever_error(nominal, truth.machine));
  return metrics;
}

}  // namespace knuckle::studies
