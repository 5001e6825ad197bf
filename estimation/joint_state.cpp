// Angles, rates, levers and cylinder forces from raw machine signals.
#include "estimation/joint_state.h"

#include <cmath>
#include <numbers>

#include "machine/description.h"

namespace knuckle::estimation {
namespace {

bool finite(const Measurement& m) noexcept {
  bool ok = m.cylinder_m.allFinite() && std::isfinite(m.hull_pitch_rad);
  for (std::size_t i = 0; i < kJoints; ++i)
    ok = ok &&
         (!m.pressures_known[i] || (std::isfinite(m.pressure_Pa[2 * i]) && std::isfinite(m.pressure_Pa[2 * i + 1])));
  return ok;
}

}  // namespace

JointStateFilter::JointStateFilter(const MachineDescription& machine, double step_s, double velocity_cutoff_Hz)
    : cylinders_(machine.cylinders),
      kinematics_(machine),
      step_s_(step_s),
      // Between samples the length is taken as straight, so its derivative is constant over a step and this blend is
      // the exact first-order filter of it.
      blend_(1.0 - std::exp(-2.0 * std::numbers::pi * velocity_cutoff_Hz * step_s)) {}

std::optional<JointState> JointStateFilter::step(const Measurement& measurement) noexcept {
  if (!finite(measurement)) return std::nullopt;
  JointState state;
  for (int i = 0; i < kJoints; ++i) {
    const std::optional<double> angle = kinematics_.joint_at(i, measurement.cylinder_m[i]);
    if (!angle) return std::nullopt;
    const std::optional<CylinderState> cylinder = kinematics_.cylinder_at(i, *angle);
    if (!cylinder) return std::nullopt;
    state.angle_rad[i] = *angle;
    state.lever_m[i] = cylinder->lever_m;
  }
  if (!started_) {
    started_ = true;
    last_cylinder_m_ = measurement.cylinder_m;
    cylinder_mps_.setZero();
  }
  cylinder_mps_ += blend_ * ((measurement.cylinder_m - last_cylinder_m_) / step_s_ - cylinder_mps_);
  last_cylinder_m_ = measurement.cylinder_m;
  state.cylinder_mps = cylinder_mps_;
  state.rate_radps = cylinder_mps_.cwiseQuotient(state.lever_m);
  state.hull_pitch_rad = measurement.hull_pitch_rad;
  state.pressures_known = measurement.pressures_known;
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (!measurement.pressures_known[i]) continue;
    const CylinderDescription& cylinder = cylinders_[i];
    state.pressure_Pa[2 * i] = measurement.pressure_Pa[2 * i];
    state.pressure_Pa[2 * i + 1] = measurement.pressure_Pa[2 * i + 1];
    state.cylinder_N[static_cast<int>(i)] = measurement.pressure_Pa[2 * i] * cylinder.head_area_m2() -
                                            measurement.pressure_Pa[2 * i + 1] * cylinder.rod_side_area_m2();
  }
  return state;
}

}  // namespace knuckle::estimation
