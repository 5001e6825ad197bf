// Extremes of a joint path, and what they are held against.
#include "estimation/identification/path_check.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/symmetric_eigen.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kRest_radps = 2e-3;  ///< Slower is at rest.
constexpr double kJump_radps2 = 50;   ///< More in one step is a jump, no motion.
constexpr double kLeastDuration_s = 1;

std::string number(double value) {
  return fmt::format("{:.4g}", value);
}

JointVector rate_at(const JointPath& path, std::size_t i) {
  const std::size_t before = i == 0 ? 0 : i - 1;
  const std::size_t after = std::min(i + 1, path.joint_rad.size() - 1);
  return (path.joint_rad[after] - path.joint_rad[before]) / (static_cast<double>(after - before) * path.step_s);
}

JointVector acceleration_at(const JointPath& path, std::size_t i) {
  if (i == 0 || i + 1 >= path.joint_rad.size()) return JointVector::Zero();
  return (path.joint_rad[i + 1] - 2 * path.joint_rad[i] + path.joint_rad[i - 1]) / (path.step_s * path.step_s);
}

/// Everything of one sample that needs the linkages.
void widen(PathExtremes& extremes, const MachineDescription& machine, const Kinematics& kinematics,
           const JointPath& path, std::size_t i) {
  const JointVector& angle = path.joint_rad[i];
  const JointVector rate = rate_at(path, i), acceleration = acceleration_at(path, i);
  double flow = 0;
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto cylinder = kinematics.cylinder_at(joint, angle[joint]);
    if (!cylinder) {
      throw InputError(std::string("path: ") + kJointNames[static_cast<std::size_t>(joint)] + " at " +
                       number(angle[joint]) + " rad, " + number(path.step_s * static_cast<double>(i)) +
                       " s: the linkage cannot close");
    }
    const double speed = cylinder->lever_m * rate[joint];
    const CylinderDescription& description = machine.cylinders[static_cast<std::size_t>(joint)];
    flow += speed > 0 ? speed * description.head_area_m2() : -speed * description.rod_side_area_m2();
    extremes.fastest_cylinder_mps[joint] = std::max(extremes.fastest_cylinder_mps[joint], std::abs(speed));
  }
  const PlanarJacobian jacobian = kinematics.tip_jacobian(angle);
  const PlanarVector tip = kinematics.tip(angle);
  extremes.flow_m3ps = std::max(extremes.flow_m3ps, flow);
  extremes.tip_speed_mps = std::max(extremes.tip_speed_mps, (jacobian * rate).norm());
  extremes.tip_mps2 = std::max(extremes.tip_mps2, (jacobian * acceleration).norm());
  extremes.lowest_tip_m = std::min(extremes.lowest_tip_m, tip.y());
  extremes.highest_tip_m = std::max(extremes.highest_tip_m, tip.y());
  extremes.farthest_tip_m = std::max(extremes.farthest_tip_m, tip.x());
  extremes.lowest_rad = extremes.lowest_rad.cwiseMin(angle);
  extremes.highest_rad = extremes.highest_rad.cwiseMax(angle);
  extremes.fastest_radps = extremes.fastest_radps.cwiseMax(rate.cwiseAbs());
}

class Findings {
 public:
  void above(const std::string& what, double value, double bound, const std::string& unit) {
    if (value > bound * (1 + 1e-9) + 1e-12) {
      lines_.push_back(what + " " + number(value) + " " + unit + ", limit " + number(bound));
    }
  }
  void below(const std::string& what, double value, double bound, const std::string& unit) {
    if (value < bound - 1e-9) lines_.push_back(what + " " + number(value) + " " + unit + ", at least " + number(bound));
  }
  void say(std::string line) { lines_.push_back(std::move(line)); }
  [[nodiscard]] std::vector<std::string> take() { return std::move(lines_); }

 private:
  std::vector<std::string> lines_;
};

/// Jumps and values that are none, which would make every other figure meaningless. @return whether all is well.
bool check_samples(const JointPath& path, Findings& findings) {
  for (std::size_t i = 0; i < path.joint_rad.size(); ++i) {
    const std::string when = " at " + number(path.step_s * static_cast<double>(i)) + " s";
    if (!path.joint_rad[i].allFinite()) {
      findings.say("angle that is not a number" + when);
      return false;
    }
    if (acceleration_at(path, i).cwiseAbs().maxCoeff() > kJump_radps2) {
      findings.say("jump" + when);
      return false;
    }
  }
  return true;
}

}  // namespace

PathExtremes path_extremes(const MachineDescription& machine, const JointPath& path, std::size_t every) {
  const Kinematics kinematics(machine);
  constexpr double kHuge = std::numeric_limits<double>::max();
  PathExtremes extremes;
  extremes.lowest_rad.setConstant(kHuge);
  extremes.highest_rad.setConstant(-kHuge);
  extremes.lowest_tip_m = kHuge;
  extremes.highest_tip_m = extremes.farthest_tip_m = -kHuge;
  for (std::size_t i = every / 2; i < path.joint_rad.size(); i += std::max<std::size_t>(1, every)) {
    widen(extremes, machine, kinematics, path, i);
  }
  return extremes;
}

std::vector<std::string> check_path(const MachineDescription& machine, const JointPath& path) {
  Findings findings;
  if (!(path.step_s > 0) || !(path.duration_s() >= kLeastDuration_s)) {
    findings.say("path of " + number(path.duration_s()) + " s in steps of " + number(path.step_s) + " s: too short");
    return findings.take();
  }
  if (!check_samples(path, findings)) return findings.take();
  PathExtremes found;
  try {
    found = path_extremes(machine, path);
  } catch (const InputError& error) {
    findings.say(error.what());
    return findings.take();
  }
  const LimitsDescription& limits = machine.limits;
  for (int joint = 0; joint < kJoints; ++joint) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
    const std::string name = kJointNames[static_cast<std::size_t>(joint)];
    findings.below(name + ": lowest angle", found.lowest_rad[joint], link.min_rad + limits.joint_soft_margin_rad,
                   "rad");
    findings.above(name + ": highest angle", found.highest_rad[joint], link.max_rad - limits.joint_soft_margin_rad,
                   "rad");
    findings.above(name + ": rate", found.fastest_radps[joint], link.max_rate_radps, "rad/s");
  }
  findings.above("pump flow", 6e4 * found.flow_m3ps, 6e4 * kPathPumpShare * machine.hydraulics.pump_flow_m3ps, "L/min");
  findings.above("tip speed", found.tip_speed_mps, limits.tip_speed_mps, "m/s");
  findings.below("floor: lowest tip", found.lowest_tip_m, limits.floor_m, "m");
  findings.above("ceiling: highest tip", found.highest_tip_m, limits.ceiling_m, "m");
  findings.above("reach: farthest tip", found.farthest_tip_m, limits.reach_m, "m");
  findings.above("start: not at rest, rate", rate_at(path, 0).cwiseAbs().maxCoeff(), kRest_radps, "rad/s");
  findings.above("end: not at rest, rate", rate_at(path, path.joint_rad.size() - 1).cwiseAbs().maxCoeff(), kRest_radps,
                 "rad/s");
  return findings.take();
}

namespace {

constexpr double kMargin_rad = 0.03;   ///< Beyond the soft margin: what following overshoots.
constexpr double kWallMargin_m = 0.1;  ///< Likewise; near a wall the gate slows down.
constexpr double kLimitShare = 0.95;   ///< Of every limit of speed.
constexpr double kGentle_mps2 = 3;     ///< Tip acceleration: tracks stay on the ground, modes stay quiet.

constexpr int kGrid = 8;
/// Where a smaller window lies in the range: 0 at its lower end, 1 at its upper one.
const std::array<JointVector, 6> kPlaces{
    {{0.5, 0.5, 0.5}, {1, 0.5, 0.5}, {0.5, 0, 0.5}, {1, 0, 0.5}, {0, 0.5, 0.5}, {0, 0, 0.5}}};

bool clear_of_walls(const LimitsDescription& limits, const Kinematics& kinematics, const PathRoom& room) {
  for (int i = 0; i < kGrid * kGrid * kGrid; ++i) {
    const int arm = i / kGrid, bucket = arm / kGrid;
    const JointVector share = JointVector(i % kGrid, arm % kGrid, bucket) / (kGrid - 1.0);
    const PlanarVector tip = kinematics.tip(room.low_rad + share.cwiseProduct(room.high_rad - room.low_rad));
    if (tip.y() < limits.floor_m + kWallMargin_m || tip.y() > limits.ceiling_m - kWallMargin_m ||
        tip.x() > limits.reach_m - kWallMargin_m) {
      return false;
    }
  }
  return true;
}

}  // namespace

PathRoom::PathRoom(const MachineDescription& machine)
    : flow_m3ps(kLimitShare * kPathPumpShare * machine.hydraulics.pump_flow_m3ps),
      tip_speed_mps(kLimitShare * machine.limits.tip_speed_mps),
      tip_mps2(kGentle_mps2) {
  const Kinematics kinematics(machine);
  const double margin = machine.limits.joint_soft_margin_rad + kMargin_rad;
  for (int joint = 0; joint < kJoints; ++joint) {
    rate_radps[joint] = kLimitShare * machine.links[static_cast<std::size_t>(joint)].max_rate_radps;
  }
  for (int twentieths = 20; twentieths >= 7; --twentieths) {
    for (const JointVector& place : kPlaces) {
      for (int joint = 0; joint < kJoints; ++joint) {
        const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
        const double whole = std::max(0.0, link.max_rad - link.min_rad - 2 * margin);
        low_rad[joint] = link.min_rad + margin + place[joint] * (1 - twentieths / 20.0) * whole;
        high_rad[joint] = low_rad[joint] + twentieths / 20.0 * whole;
      }
      if (clear_of_walls(machine.limits, kinematics, *this)) return;
    }
  }
  throw InputError(machine.source + ": no room to move in between the virtual walls of [limits]");
}

double PathRoom::speed_use(const PathExtremes& extremes, double fastest_mps) const {
  return std::max({extremes.fastest_radps.cwiseQuotient(rate_radps).maxCoeff(), extremes.flow_m3ps / flow_m3ps,
                   extremes.tip_speed_mps / tip_speed_mps, extremes.fastest_cylinder_mps.maxCoeff() / fastest_mps});
}

// Normal matrix of the regressor along a path, and its condition.

namespace {

constexpr int kFrictionColumns = 3;  ///< Coulomb extending, Coulomb retracting, viscous.
constexpr int kColumns = kBaseParameters + kJoints * kFrictionColumns;
constexpr double kSlip_mps = 1e-3;  ///< Friction turns round over this speed.
using TorqueRows = Eigen::Matrix<double, kJoints, kColumns>;

/// Torque rows to rows of cylinder force.
TorqueRows rows_at(const Kinematics& kinematics, const RigidArm& arm, const JointVector& angle, const JointVector& rate,
                   const JointVector& acceleration) {
  TorqueRows rows = TorqueRows::Zero();
  const Regressor absolute_rows = arm.inverse_dynamics(Pose(angle, 0), absolute(rate), absolute(acceleration));
  for (int column = 0; column < kBaseParameters; ++column) {
    rows.col(column) = joint_torque(absolute_rows.col(column));
  }
  for (int joint = 0; joint < kJoints; ++joint) {
    const auto cylinder = kinematics.cylinder_at(joint, angle[joint]);
    const double lever = cylinder ? cylinder->lever_m : 0;
    const double speed = lever * rate[joint];
    const double slip = std::clamp(speed / kSlip_mps, -1.0, 1.0);
    const int first = kBaseParameters + joint * kFrictionColumns;
    rows(joint, first) = lever * std::max(0.0, slip);
    rows(joint, first + 1) = lever * std::min(0.0, slip);
    rows(joint, first + 2) = lever * speed;
    rows.row(joint) /= std::max(kLeastSureLever_m, std::abs(lever));
  }
  return rows;
}

}  // namespace

PathCondition::PathCondition(const MachineDescription& machine, bool with_inertia)
    : kinematics_(machine), arm_(machine), with_inertia_(with_inertia) {}

double PathCondition::operator()(const JointPath& path, std::size_t every) const {
  Eigen::Matrix<double, kColumns, kColumns> normal = Eigen::Matrix<double, kColumns, kColumns>::Zero();
  const double step_s = path.step_s;
  for (std::size_t i = std::max<std::size_t>(1, every / 2); i + 1 < path.joint_rad.size(); i += every) {
    const JointVector &before = path.joint_rad[i - 1], &at = path.joint_rad[i], &after = path.joint_rad[i + 1];
    const TorqueRows rows =
        rows_at(kinematics_, arm_, at, (after - before) / (2 * step_s), (after - 2 * at + before) / (step_s * step_s));
    normal.noalias() += rows.transpose() * rows;
  }
  const int first = with_inertia_ ? 0 : kMomentX;  // the inertias come first
  const int columns = kColumns - first;
  const Eigen::VectorXd scale = normal.diagonal().tail(columns).cwiseSqrt();
  if (!(scale.minCoeff() > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal.bottomRightCorner(columns, columns) *
                                 scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd eigenvalues = symmetric_eigen(scaled).values;
  if (!(eigenvalues[0] > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(eigenvalues[columns - 1] / eigenvalues[0]);
}

}  // namespace knuckle::estimation
