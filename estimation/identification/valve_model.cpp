#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimation/identification/smoothing.h"
#include "estimation/identification/valve_identification.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

constexpr double kBox_s = 0.1;           ///< Each of two boxes over speeds of model and encoder.
constexpr double kLeastDrop_Pa = 0.5e5;  ///< Below it the root amplifies offsets beyond use.

/// The spool behind its command: delay, hysteresis as play, second order by exact transition.
class SpoolModel {
 public:
  SpoolModel(const ValveDescription& valve, double step_s) : half_(valve.hysteresis / 2) {
    const double w = 2 * std::numbers::pi * valve.natural_frequency_Hz;
    const double zeta = std::min(valve.damping_ratio, 0.999);
    const double wd = w * std::sqrt(1 - zeta * zeta), decay = std::exp(-zeta * w * step_s);
    const double c = std::cos(wd * step_s), s = std::sin(wd * step_s) / wd;
    transition_ << decay * (c + zeta * w * s), decay * s, -decay * w * w * s, decay * (c - zeta * w * s);
  }
  /// @return position after a step with this command.
  double step(double command) {
    played_ = std::clamp(played_, command - half_, command + half_);
    state_[0] -= played_;
    state_ = transition_ * state_;
    state_[0] += played_;
    return state_[0];
  }

 private:
  double half_, played_ = 0;
  Eigen::Matrix2d transition_;
  Eigen::Vector2d state_ = Eigen::Vector2d::Zero();
};

/// Between samples the spool is smooth, unlike its command: the delay need not be whole steps. Differences about a
/// delay of zero ask for one below.
double delayed(const std::vector<double>& position, double steps, std::size_t i) {
  const double at = std::clamp(static_cast<double>(i) - steps, 0.0, static_cast<double>(position.size() - 1));
  const auto before = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(before);
  return position[before] + (share > 0 ? share * (position[before + 1] - position[before]) : 0);
}

std::vector<double> smoothed(const std::vector<double>& values, double step_s) {
  const Eigen::MatrixXd row =
      Eigen::Map<const Eigen::RowVectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  const auto half = static_cast<Eigen::Index>(std::lround(kBox_s / step_s / 2));
  const std::vector<Stretch> whole{{0, static_cast<Eigen::Index>(values.size())}};
  const Eigen::MatrixXd once = running_mean(row, half, whole);
  const Eigen::MatrixXd twice = running_mean(once, half, whole);
  return {twice.data(), twice.data() + twice.size()};
}

std::vector<double> spool_without_delay(const ValveDescription& valve, const AxisStretch& axis) {
  SpoolModel model(valve, axis.step_s);
  std::vector<double> position(axis.command.size(), 0);
  for (std::size_t i = 0; i + 1 < position.size(); ++i) position[i + 1] = model.step(axis.command[i]);
  return position;
}

std::vector<double> measured_mps(const AxisStretch& axis) {
  std::vector<double> speed(axis.length_m.size(), 0);
  for (std::size_t i = 1; i + 1 < speed.size(); ++i)
    speed[i] = (axis.length_m[i + 1] - axis.length_m[i - 1]) / (2 * axis.step_s);
  return smoothed(speed, axis.step_s);
}

/// What stands for the pressures of a cylinder without transmitters. Steady flow through both metering edges, the pump
/// at the highest load plus its margin:
///   p_out - p_tank = A_out^2 d / (A_A^3 + A_B^3),  d = p_s A_in - p_tank A_out -+ F,  F the weight on the cylinder.
class WeighedPressures {
 public:
  WeighedPressures(const MachineDescription& machine, int joint)
      : machine_(machine), kinematics_(machine), base_(known_parameters(machine)), joint_(joint) {}

  /// @return false where a length has no angle.
  bool add(const Measurement& m, const JointVector& valve, AxisStretch& axis) const {
    JointVector angle_rad;
    for (int j = 0; j < kJoints; ++j) {
      const auto angle = kinematics_.joint_at(j, m.cylinder_m[j] - machine_.sensors.encoder_offset_m[j]);
      if (!angle) return false;
      angle_rad[j] = *angle;
    }
    const JointVector weight_Nm = joint_torque(RigidArm::gravity(Pose(angle_rad, m.hull_pitch_rad)) * base_);
    const double weight_N = weight_Nm[joint_] / kinematics_.cylinder_at(joint_, angle_rad[joint_])->lever_m;
    const double supply_Pa = supply_of_others_Pa(m, valve);
    axis.rod_Pa.push_back(return_Pa(supply_Pa, weight_N, true));
    axis.head_Pa.push_back(return_Pa(supply_Pa, weight_N, false));
    return true;
  }

 private:
  [[nodiscard]] double supply_of_others_Pa(const Measurement& m, const JointVector& valve) const {
    double load_Pa = 0;
    for (int j = 0; j < kJoints; ++j) {
      const ValveDescription& edges = machine_.cylinders[static_cast<std::size_t>(j)].valve;
      if (j == joint_ || !(edges.opening(valve[j]) > 0)) continue;
      load_Pa = std::max(load_Pa, m.pressure_Pa[static_cast<std::size_t>(2 * j + (valve[j] > 0 ? 0 : 1))]);
    }
    return std::min(load_Pa + machine_.hydraulics.load_sensing_margin_Pa, machine_.hydraulics.main_relief_Pa);
  }
  [[nodiscard]] double return_Pa(double supply_of_others_Pa, double weight_N, bool extends) const {
    const CylinderDescription& cylinder = machine_.cylinders[static_cast<std::size_t>(joint_)];
    const double head = cylinder.head_area_m2(), rod = cylinder.rod_side_area_m2();
    const double cubes = head * head * head + rod * rod * rod;
    const double in = extends ? head : rod, out = extends ? rod : head, load_N = extends ? weight_N : -weight_N;
    // Of its own load the pump's margin stands over the inlet edge.
    const double own_N = machine_.hydraulics.load_sensing_margin_Pa * cubes / (in * in);
    const double drive_N = std::max(own_N, supply_of_others_Pa * in - machine_.hydraulics.tank_Pa * out - load_N);
    return machine_.hydraulics.tank_Pa + out * out * drive_N / cubes;
  }

  const MachineDescription& machine_;
  Kinematics kinematics_;
  BaseParameters base_;
  int joint_;
};

}  // namespace

ValveVector valve_vector(const ValveDescription& file) {
  ValveVector p;
  p << file.dead_band_extend, file.dead_band_retract, file.delay_s, file.nominal_flow_m3ps, 0, 0, file.curve_exponent,
      file.retract_share, file.notch_opening, file.notch_slope;
  return p;
}

ValveCalibration valve_calibration(const ValveVector& p) {
  return {.dead_band_extend = p[kDeadExtend],
          .dead_band_retract = p[kDeadRetract],
          .delay_s = p[kDelay],
          .nominal_flow_m3ps = p[kGain],
          .curve_exponent = p[kExponent],
          .retract_share = p[kRetractShare],
          .notch_opening = p[kNotchOpening],
          .notch_slope = p[kNotchSlope]};
}

std::vector<AxisStretch> axis_stretches(const MachineDescription& machine, std::span<const Recording> recordings,
                                        int joint) {
  std::vector<AxisStretch> result;
  const auto k = static_cast<std::size_t>(joint);
  const bool weighed = joint == machine.sensors.without_pressures;
  const WeighedPressures weights(machine, joint);
  for (const Recording& recording : recordings) {
    if (recording.valve.size() != recording.samples.size()) continue;
    std::vector<std::uint8_t> known = recording.usable;
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!std::isfinite(recording.valve[i][joint])) known[i] = 0;
    }
    for (const Stretch& stretch : usable_stretches(known)) {
      if (static_cast<double>(stretch.size()) * recording.step_s < 4 * kValveSettle_s) continue;
      AxisStretch axis{};
      axis.step_s = recording.step_s;
      axis.weighed = weighed;
      for (auto i = static_cast<std::size_t>(stretch.first); i < static_cast<std::size_t>(stretch.end); ++i) {
        if (weighed && !weights.add(recording.samples[i], recording.valve[i], axis)) break;
        axis.command.push_back(recording.valve[i][joint]);
        axis.length_m.push_back(recording.samples[i].cylinder_m[joint]);
        if (weighed) continue;
        axis.head_Pa.push_back(recording.samples[i].pressure_Pa[2 * k]);
        axis.rod_Pa.push_back(recording.samples[i].pressure_Pa[2 * k + 1]);
      }
      if (static_cast<double>(axis.command.size()) * recording.step_s < 4 * kValveSettle_s) continue;
      axis.spool = spool_without_delay(machine.cylinders[k].valve, axis);
      axis.measured_mps = measured_mps(axis);
      result.push_back(std::move(axis));
    }
  }
  return result;
}

std::vector<double> AxisModel::speed_mps(const AxisStretch& axis, const ValveVector& p,
                                         std::vector<double>& drop_Pa) const {
  std::vector<double> speed(axis.command.size());
  drop_Pa.assign(speed.size(), 0);
  ValveDescription valve = cylinder_.valve;
  valve.dead_band_extend = p[kDeadExtend];
  valve.dead_band_retract = p[kDeadRetract];
  valve.curve_exponent = p[kExponent];
  valve.retract_share = p[kRetractShare];
  valve.notch_opening = p[kNotchOpening];
  valve.notch_slope = p[kNotchSlope];
  for (std::size_t i = 0; i < speed.size(); ++i) {
    const double x = delayed(axis.spool, p[kDelay] / axis.step_s, i);
    const bool extends = x > 0;
    const double share = valve.flow_share(valve.opening(x), extends);
    const double out_Pa = extends ? axis.rod_Pa[i] - p[kRodOffset] : axis.head_Pa[i] - p[kHeadOffset];
    const double area = extends ? cylinder_.rod_side_area_m2() : cylinder_.head_area_m2();
    drop_Pa[i] = std::max(kLeastDrop_Pa, out_Pa - hydraulics_.tank_Pa);
    const double flow = p[kGain] * share * std::sqrt(drop_Pa[i] / cylinder_.valve.nominal_drop_Pa);
    speed[i] = (extends ? 1 : -1) * (flow + (share > 0 ? compression(axis, i, extends) : 0)) / area;
  }
  return speed;
}

double AxisModel::compression(const AxisStretch& axis, std::size_t i, bool extends) const {
  constexpr std::size_t kAround = 10;
  if (axis.weighed || i < kAround || i + kAround >= axis.command.size()) return 0;
  const std::vector<double>& out = extends ? axis.rod_Pa : axis.head_Pa;
  const double rate = (out[i + kAround] - out[i - kAround]) / (2 * kAround * axis.step_s);
  const double column = extends ? cylinder_.rod_side_area_m2() * (cylinder_.max_length_m - axis.length_m[i])
                                : cylinder_.head_area_m2() * (axis.length_m[i] - cylinder_.min_length_m);
  return (hydraulics_.hose_volume_m3 + std::max(0.0, column)) / hydraulics_.bulk_modulus_Pa * rate;
}

AxisSpeeds AxisModel::speeds(const AxisStretch& axis, const ValveVector& parameters) const {
  std::vector<double> drop_Pa;
  const std::vector<double> modelled = smoothed(speed_mps(axis, parameters, drop_Pa), axis.step_s);
  const auto settle = static_cast<std::size_t>(kValveSettle_s / axis.step_s);
  const auto every = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(kValveEvery_s / axis.step_s)));
  AxisSpeeds result;
  for (std::size_t i = settle; i + settle < modelled.size(); i += every) {
    result.measured_mps.push_back(axis.measured_mps[i]);
    result.modelled_mps.push_back(modelled[i]);
    result.least_drop_Pa.push_back(drop_Pa[i]);
  }
  return result;
}

}  // namespace knuckle::estimation
