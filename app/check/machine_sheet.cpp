#include "app/check/machine_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "machine/load.h"
#include "machine/room.h"
#include "machine/toml_reader.h"

namespace knuckle::checking {
namespace {

std::string range_text(double low, double high, int digits) {
  return fmt::format("{:.{}f} to {:.{}f}", low, digits, high, digits);
}

std::string joint_line(const MachineDescription& machine, const Kinematics& kinematics, int joint) {
  const auto i = static_cast<std::size_t>(joint);
  const LinkDescription& link = machine.links[i];
  const CylinderDescription& cylinder = machine.cylinders[i];
  const JointSpan span = cylinder_span(machine, kinematics, joint);
  const auto [low_m, high_m] = std::minmax(kinematics.cylinder_at(joint, link.min_rad)->length_m,
                                           kinematics.cylinder_at(joint, link.max_rad)->length_m);
  const LeverRange lever = lever_range(machine, kinematics, joint);
  return fmt::format("{:<7} {:<17} {:<17} {:<15} {:<15} {:<15} {:<6} {:.3f}", kJointNames[i],
                     range_text(link.min_rad, link.max_rad, 3), range_text(span.min_rad, span.max_rad, 3),
                     range_text(low_m, high_m, 3), range_text(cylinder.min_length_m, cylinder.max_length_m, 3),
                     range_text(lever.shortest_m, lever.longest_m, 3), number_text(link.max_rate_radps),
                     std::floor(1000 * fastest_rate_radps(machine, kinematics, joint)) / 1000);
}

}  // namespace

std::vector<std::string> machine_sheet(const MachineDescription& machine) {
  const Kinematics kinematics(machine);
  std::vector<std::string> lines{fmt::format("{:<7} {:<17} {:<17} {:<15} {:<15} {:<15} {}", "", "joint range, rad",
                                             "cylinder allows", "cylinder, m", "can be", "lever, m", "fastest, rad/s"),
                                 fmt::format("{:<7} {:<17} {:<17} {:<15} {:<15} {:<15} {:<6} {}", "joint", "file",
                                             "computed", "computed", "file", "computed", "file", "pump gives")};
  for (int joint = 0; joint < kJoints; ++joint) lines.push_back(joint_line(machine, kinematics, joint));
  for (const WallRoom& room : wall_rooms(machine))
    lines.push_back(
        fmt::format("limits.{} = {} m: the tip goes to {:.2f} m{}", room.key, number_text(room.limit_m), room.reached_m,
                    room.cut_share > 0 ? fmt::format(", {:.0f} % of all poses cut off", 100 * room.cut_share)
                                       : ", outside of all poses"));
  lines.push_back(fmt::format("bus: {:.1f} % of {} kbit/s with worst-case stuffing", 100 * worst_bus_load(machine.bus),
                              machine.bus.bit_rate / 1000));
  return lines;
}

std::vector<std::string> device_sheet(const DeviceDescription& device) {
  std::vector<std::string> lines{fmt::format("{:<8} {:<18} {:<14} {}", "joint", "joint range, rad", "step, rad",
                                             "force at the tip, stretched: rated, peak N")};
  constexpr PerJoint<const char*> kNames{"forearm", "wrist", "finger"};
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double to_tip_m = device.link_m.tail(kJoints - static_cast<int>(i)).sum();
    const double tip_N_per_A = device.torque_constant_Nm_per_A[i] * device.gear_ratio[i] / to_tip_m;
    lines.push_back(fmt::format("{:<8} {:<18} {:<14.2g} {:.1f}, {:.1f}", kNames[i],
                                range_text(device.min_rad[i], device.max_rad[i], 3),
                                2 * std::numbers::pi / (device.counts_per_turn[i] * device.gear_ratio[i]),
                                tip_N_per_A * device.rated_current_A[i], tip_N_per_A * device.peak_current_A[i]));
  }
  lines.push_back(fmt::format("feel.force_limit_N = {}", number_text(device.feel.force_limit_N)));
  return lines;
}

}  // namespace knuckle::checking
