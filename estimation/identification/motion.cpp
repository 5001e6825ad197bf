#include "estimation/identification/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/identification/savitzky_golay.h"
#include "estimation/identification/zero_phase.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

using Smooth = MotionOptions::Smooth;

bool finite(const Measurement& m) noexcept {
  return m.cylinder_m.allFinite() && std::isfinite(m.hull_pitch_rad) &&
         std::all_of(m.pressure_Pa.begin(), m.pressure_Pa.end(), [](double p) { return std::isfinite(p); });
}

Eigen::Matrix3Xd unknown(Eigen::Index size) {
  return Eigen::Matrix3Xd::Constant(3, size, std::numeric_limits<double>::quiet_NaN());
}

/// Raw signals, and which samples have all of them.
struct Raw {
  Raw(const MachineDescription& machine, const Kinematics& kinematics, const Recording& recording,
      const JointVector& compliance_radpNm)
      : cylinder_m(unknown(static_cast<Eigen::Index>(recording.samples.size()))),
        joint_rad(cylinder_m),
        cylinder_N(cylinder_m),
        pressure_sum_Pa(cylinder_m),
        pitch_rad(cylinder_m.row(0)) {
    std::vector<std::uint8_t> known(recording.samples.size(), 0);
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
      const Measurement& m = recording.samples[i];
      const auto n = static_cast<Eigen::Index>(i);
      if (recording.usable[i] == 0 || !finite(m)) continue;
      cylinder_m.col(n) = m.cylinder_m - machine.sensors.encoder_offset_m;
      pitch_rad[n] = m.hull_pitch_rad;
      known[i] = 1;
      for (int j = 0; j < kJoints; ++j) {
        const auto k = static_cast<std::size_t>(j);
        cylinder_N(j, n) = m.pressure_Pa[2 * k] * machine.cylinders[k].head_area_m2() -
                           m.pressure_Pa[2 * k + 1] * machine.cylinders[k].rod_side_area_m2();
        pressure_sum_Pa(j, n) = m.pressure_Pa[2 * k] + m.pressure_Pa[2 * k + 1];
        if (compliance_radpNm[j] != 0) bend(kinematics, j, n, compliance_radpNm[j]);
        const auto angle = kinematics.joint_at(j, cylinder_m(j, n));
        if (!angle) known[i] = 0;
        joint_rad(j, n) = angle.value_or(std::numeric_limits<double>::quiet_NaN());
      }
    }
    stretches = usable_stretches(known);
  }
  Eigen::Matrix3Xd cylinder_m, joint_rad, cylinder_N, pressure_sum_Pa;
  Eigen::RowVectorXd pitch_rad;
  std::vector<Stretch> stretches;

 private:
  /// The length that the link is at, c r F behind the encoder's angle.
  void bend(const Kinematics& kinematics, int j, Eigen::Index n, double compliance_radpNm) {
    const auto angle = kinematics.joint_at(j, cylinder_m(j, n));
    const auto cylinder = angle ? kinematics.cylinder_at(j, *angle) : std::nullopt;
    if (cylinder) cylinder_m(j, n) -= cylinder->lever_m * cylinder->lever_m * compliance_radpNm * cylinder_N(j, n);
  }
};

/// Angle, rate, lever and cylinder of one sample from what was smoothed; false where the linkage has no answer.
bool place(const Kinematics& kinematics, Smooth smooth, const JointVector& value, const JointVector& rate,
           Eigen::Index n, Motion& motion) {
  for (int j = 0; j < kJoints; ++j) {
    const auto angle = smooth == Smooth::kJointAngle ? std::optional(value[j]) : kinematics.joint_at(j, value[j]);
    const auto cylinder = angle ? kinematics.cylinder_at(j, *angle) : std::nullopt;
    if (!cylinder) return false;
    motion.joint_rad(j, n) = *angle;
    motion.lever_m(j, n) = cylinder->lever_m;
    motion.cylinder_m(j, n) = cylinder->length_m;
    const bool of_angle = smooth == Smooth::kJointAngle;
    motion.joint_radps(j, n) = of_angle ? rate[j] : rate[j] / cylinder->lever_m;
    motion.cylinder_mps(j, n) = of_angle ? rate[j] * cylinder->lever_m : rate[j];
  }
  return true;
}

}  // namespace

int half_window(double window_s, double step_s) noexcept {
  return std::max(1, static_cast<int>(std::lround((window_s / step_s - 1) / 2)));
}

int smoothing_half_window(const MotionOptions& options, double step_s) noexcept {
  return std::max(half_window(options.window_s, step_s), (options.order + 1) / 2);
}

Motion offline_motion(const MachineDescription& machine, const Recording& recording, const MotionOptions& options) {
  const Kinematics kinematics(machine);
  const Raw raw(machine, kinematics, recording, options.compliance_radpNm);
  const Eigen::Index size = raw.cylinder_m.cols();
  const int half = smoothing_half_window(options, recording.step_s);
  const Eigen::VectorXd smoothing = savitzky_golay(half, options.order, 0, recording.step_s);
  const Eigen::VectorXd derivative = savitzky_golay(half, options.order, 1, recording.step_s);

  Motion motion;
  motion.step_s = recording.step_s;
  motion.joint_rad = motion.joint_radps = motion.cylinder_m = motion.cylinder_mps = motion.lever_m = unknown(size);
  motion.cylinder_N = raw.cylinder_N;
  if (options.pressure_lag_s > 0)
    motion.cylinder_N += options.pressure_lag_s * filtered(raw.cylinder_N, derivative, raw.stretches);
  motion.smooth_cylinder_N = filtered(raw.cylinder_N, smoothing, raw.stretches);
  motion.smooth_pressure_sum_Pa = filtered(raw.pressure_sum_Pa, smoothing, raw.stretches);
  motion.hull_pitch_rad =
      running_mean(raw.pitch_rad, half_window(options.pitch_window_s, recording.step_s), raw.stretches);

  const Eigen::Matrix3Xd& position = options.smooth == Smooth::kJointAngle ? raw.joint_rad : raw.cylinder_m;
  const Eigen::Matrix3Xd value = filtered(position, smoothing, raw.stretches),
                         rate = filtered(position, derivative, raw.stretches);
  std::vector<std::uint8_t> known(static_cast<std::size_t>(size), 0);
  for (const Stretch& stretch : shortened(raw.stretches, half)) {
    for (Eigen::Index i = stretch.first; i < stretch.end; ++i)
      known[static_cast<std::size_t>(i)] = place(kinematics, options.smooth, value.col(i), rate.col(i), i, motion);
  }
  motion.stretches = usable_stretches(known);
  return motion;
}

}  // namespace knuckle::estimation
