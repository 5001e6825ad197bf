// Recordings of a machine that is exactly some torque model: no simulator, no noise, so that a test knows all there is.
#pragma once

#include <cmath>
#include <functional>

#include "estimation/identification/excitation.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {

/// Exact state of prescribed motion.
struct ExactMotion {
  JointVector angle, rate, acceleration;
};
using MotionLaw = std::function<ExactMotion(double t_s)>;
/// Torques that the cylinders must have given.
using TorqueLaw = std::function<JointVector(const ExactMotion&)>;

inline Measurement exact_measurement(const MachineDescription& machine, const Kinematics& kinematics,
                                     const JointVector& angle_rad, const JointVector& torque_Nm) {
  constexpr double kBack_Pa = 30e5;
  Measurement m;
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const CylinderState cylinder = *kinematics.cylinder_at(i, angle_rad[i]);
    const CylinderDescription& d = machine.cylinders[k];
    m.cylinder_m[i] = cylinder.length_m;
    m.pressure_Pa[2 * k] = (torque_Nm[i] / cylinder.lever_m + kBack_Pa * d.rod_side_area_m2()) / d.head_area_m2();
    m.pressure_Pa[2 * k + 1] = kBack_Pa;
  }
  return m;
}

inline Recording exact_recording(const MachineDescription& machine, double duration_s, double step_s,
                                 const MotionLaw& motion, const TorqueLaw& torque) {
  const Kinematics kinematics(machine);
  Recording recording;
  recording.source = "synthetic";
  recording.step_s = step_s;
  const auto count = static_cast<std::size_t>(std::lround(duration_s / step_s));
  for (std::size_t i = 0; i < count; ++i) {
    const ExactMotion m = motion(static_cast<double>(i) * step_s);
    recording.samples.push_back(exact_measurement(machine, kinematics, m.angle, torque(m)));
  }
  recording.usable.assign(count, 1);
  return recording;
}

/// Minimum-jerk moves from pose to pose with rests between them.
inline MotionLaw stop_and_go(std::vector<JointVector> poses, double move_s, double rest_s) {
  return [poses = std::move(poses), move_s, rest_s](double t) {
    const double each = move_s + rest_s;
    const auto n = std::min(static_cast<std::size_t>(t / each), poses.size() - 1);
    const double s = std::min(1.0, (t - static_cast<double>(n) * each) / move_s);
    const JointVector way = poses[n] - (n == 0 ? poses[0] : poses[n - 1]);
    ExactMotion m;
    m.angle = poses[n] - way * (1 - s * s * s * (10 - 15 * s + 6 * s * s));
    m.rate = way * 30 * s * s * (1 - s) * (1 - s) / move_s;
    m.acceleration = way * 60 * s * (1 - s) * (1 - 2 * s) / (move_s * move_s);
    return m;
  };
}

/// Two sines a joint about the middle of the range, of rods of the 1.5 t class.
inline MotionLaw waving(double speed = 1) {
  return [speed](double t) {
    const JointVector middle(0.3, -1.5, -0.9), size(0.25, 0.4, 0.7), other(0.1, 0.15, 0.3);
    const JointVector w = speed * JointVector(0.5, 0.62, 0.71), v = 2.3 * w;
    ExactMotion m;
    for (int i = 0; i < kJoints; ++i) {
      m.angle[i] = middle[i] + size[i] * std::sin(w[i] * t) + other[i] * std::sin(v[i] * t);
      m.rate[i] = size[i] * w[i] * std::cos(w[i] * t) + other[i] * v[i] * std::cos(v[i] * t);
      m.acceleration[i] = -size[i] * w[i] * w[i] * std::sin(w[i] * t) - other[i] * v[i] * v[i] * std::sin(v[i] * t);
    }
    return m;
  };
}

}  // namespace knuckle::estimation
