#include "estimation/identification/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "estimation/identification/full.h"
#include "estimation/identification/smoothing.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

using Smooth = MotionOptions::Smooth;

/// @param without joint whose cylinder has no transmitters, or none.
bool finite(const Measurement& m, int without) noexcept {
  bool all = m.cylinder_m.allFinite() && std::isfinite(m.hull_pitch_rad);
  for (int k = 0; k < 2 * kJoints; ++k)
    all = all && (k / 2 == without || std::isfinite(m.pressure_Pa[static_cast<std::size_t>(k)]));
  return all;
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
    const int without = machine.sensors.without_pressures;
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
      const Measurement& m = recording.samples[i];
      const auto n = static_cast<Eigen::Index>(i);
      if (recording.usable[i] == 0 || !finite(m, without)) continue;
      cylinder_m.col(n) = m.cylinder_m - machine.sensors.encoder_offset_m;
      pitch_rad[n] = m.hull_pitch_rad;
      known[i] = 1;
      for (int j = 0; j < kJoints; ++j) {
        const auto k = static_cast<std::size_t>(j);
        if (j != without) {
          cylinder_N(j, n) = m.pressure_Pa[2 * k] * machine.cylinders[k].head_area_m2() -
                             m.pressure_Pa[2 * k + 1] * machine.cylinders[k].rod_side_area_m2();
          pressure_sum_Pa(j, n) = m.pressure_Pa[2 * k] + m.pressure_Pa[2 * k + 1];
          if (compliance_radpNm[j] != 0) bend(kinematics, j, n, compliance_radpNm[j]);
        }
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

namespace {

constexpr double kShift_s = 0.05;       // between the shifts tried: within less the error hardly grows
constexpr double kReviewStep_s = 0.02;  // coarse is enough and quick
constexpr double kCutoff_Hz = 2;
constexpr double kShortest_s = 20;  // less motion fits any shift

/// Share of the torque's variance that the model, identified anew, leaves; none where it cannot be solved for.
std::optional<double> unexplained(const MachineDescription& machine, const std::vector<Recording>& recordings) {
  FullOptions options;
  options.usual_errors = false;  // only parameters count
  const FullResult found = identify_full(machine, recordings, options);
  if (found.summary.parameters.empty()) return {};
  double left = 0;
  for (const Recording& recording : recordings) {
    const TorqueComparison comparison = compare_torque(found.dynamics, machine, recording);
    for (const double nrmse : torque_fit(comparison, kCutoff_Hz).nrmse) {
      if (std::isfinite(nrmse)) left += nrmse * nrmse * recording.duration_s();
    }
  }
  return left;
}

}  // namespace

Recording without_pressure_lag(const Recording& recording, double lag_s) {
  Recording result = recording;
  const double later = lag_s / recording.step_s, last = static_cast<double>(recording.samples.size()) - 1;
  for (std::size_t i = 0; i < result.samples.size(); ++i) {
    const double at = static_cast<double>(i) + later;
    if (at < 0 || at > last) {
      result.usable[i] = 0;
      continue;
    }
    const auto before = static_cast<std::size_t>(at);
    const std::size_t after = std::min(before + 1, recording.samples.size() - 1);
    const double share = at - static_cast<double>(before);
    for (std::size_t c = 0; c < result.samples[i].pressure_Pa.size(); ++c) {
      const double from = recording.samples[before].pressure_Pa[c], to = recording.samples[after].pressure_Pa[c];
      result.samples[i].pressure_Pa[c] = from + share * (to - from);
    }
    if (recording.usable[before] == 0 || recording.usable[after] == 0) result.usable[i] = 0;
  }
  return result;
}

std::optional<double> pressure_lag_s(const MachineDescription& machine, const std::vector<Recording>& recordings) {
  double duration_s = 0;
  for (const Recording& recording : recordings) duration_s += recording.duration_s();
  if (duration_s < kShortest_s) return {};
  const int most = static_cast<int>(std::lround(kMostPressureLag_s / kShift_s));
  std::map<int, double> left;  // by shift
  const auto at = [&](int shift) -> std::optional<double> {
    if (const auto known = left.find(shift); known != left.end()) return known->second;
    std::vector<Recording> tried;
    for (const Recording& recording : recordings) {
      const auto every = static_cast<std::size_t>(std::max(1.0, std::floor(kReviewStep_s / recording.step_s)));
      tried.push_back(decimated(without_pressure_lag(recording, kShift_s * shift), every));
    }
    const auto found = unexplained(machine, tried);
    if (found) left[shift] = *found;
    return found;
  };
  // Downhill from no shift, then to the bottom of the parabola through the lowest and its neighbours.
  for (int shift = 0; std::abs(shift) <= most;) {
    const auto before = at(shift - 1), here = at(shift), after = at(shift + 1);
    if (!before || !here || !after) return {};
    if (*here <= *before && *here <= *after) {
      const double bend = *before - 2 * *here + *after;
      return kShift_s * (shift + (bend > 0 ? 0.5 * (*before - *after) / bend : 0));
    }
    const int next = shift + (*before < *after ? -1 : 1);
    if (std::abs(next) > most) {
      return std::copysign(kMostPressureLag_s, static_cast<double>(shift));
    }
    shift = next;
  }
  return {};
}

}  // namespace knuckle::estimation
