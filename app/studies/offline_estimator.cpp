#include "app/studies/offline_estimator.h"

#include "machine/description.h"

namespace knuckle::studies {
namespace {

constexpr double kVelocityCutoff_Hz = 10;  // of the slave loop; the force estimator has rates of its own

}  // namespace

OfflineEstimator::OfflineEstimator(const MachineDescription& machine, double step_s)
    : offset_m_(machine.sensors.encoder_offset_m),
      filter_(machine, step_s, kVelocityCutoff_Hz),
      force_(machine, step_s),
      payload_(machine, step_s) {}

std::vector<EstimateSample> OfflineEstimator::run(const estimation::Recording& recording) {
  filter_.reset();
  force_.restart_motion();
  payload_.restart_motion();
  std::vector<EstimateSample> result(recording.samples.size());
  for (std::size_t k = 0; k < recording.samples.size(); ++k) {
    estimation::Measurement measurement = recording.samples[k];
    measurement.cylinder_m -= offset_m_;
    const auto state = recording.usable[k] != 0 ? filter_.step(measurement) : std::nullopt;
    if (!state) {
      filter_.reset();
      force_.restart_motion();
      payload_.restart_motion();
      continue;
    }
    const estimation::ForceEstimate& force = force_.step(*state);
    payload_.step(*state, force);
    force_.hold_bias(payload_.maybe_loaded());
    force_.carry(payload_.carried());
    result[k] = {
        force.loaded_tip_N,
        force.tip_N,
        force.covariance_N2,
        {state->angle_rad, state->lever_m, force.joint_torque_Nm + force.carried_Nm, force.joint_covariance_Nm2},
        force.contact,
        true};
  }
  return result;
}

}  // namespace knuckle::studies
