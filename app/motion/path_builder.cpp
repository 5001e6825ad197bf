#include "app/motion/path_builder.h"

#include "machine/description.h"

namespace knuckle::motion {
namespace {

constexpr double kSpeedShare = 0.6;  // of each joint's rate, the pump's flow and the tip's speed
constexpr double kShortest_s = 1.0;
constexpr int kPlaces = 20;  // looked at along the way

/// Oil that the joints' displacement takes per unit of the way [m^3], where the machine stands at `joint_rad`.
double oil(const MachineDescription& machine, const Kinematics& kinematics, const JointVector& joint_rad,
           const JointVector& way_rad) noexcept {
  double volume = 0;
  for (int i = 0; i < kJoints; ++i) {
    const auto cylinder = kinematics.cylinder_at(i, joint_rad[i]);
    if (!cylinder) continue;
    const auto& data = machine.cylinders[static_cast<std::size_t>(i)];
    const double stroke = cylinder->lever_m * way_rad[i];
    volume += stroke > 0 ? stroke * data.head_area_m2() : -stroke * data.rod_side_area_m2();
  }
  return volume;
}

}  // namespace

estimation::JointPath transfer(const MachineDescription& machine, const Kinematics& kinematics,
                               const JointVector& from_rad, const JointVector& to_rad, double step_s) {
  const JointVector way = to_rad - from_rad;
  double slowest = 0;  // time that each limit would need at constant speed
  for (int i = 0; i < kJoints; ++i) {
    slowest = std::max(slowest, std::abs(way[i]) / machine.links[static_cast<std::size_t>(i)].max_rate_radps);
  }
  for (int place = 0; place <= kPlaces; ++place) {
    const JointVector joint_rad = from_rad + way * place / kPlaces;
    slowest = std::max(slowest, oil(machine, kinematics, joint_rad, way) / machine.hydraulics.pump_flow_m3ps);
    slowest = std::max(slowest, (kinematics.tip_jacobian(joint_rad) * way).norm() / machine.limits.tip_speed_mps);
  }
  PathBuilder path(from_rad, step_s);
  path.move(to_rad, std::max(kShortest_s, PathBuilder::kPeak * slowest / kSpeedShare));
  return path.path();
}

}  // namespace knuckle::motion
