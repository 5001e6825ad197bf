#include "app/identify/contact_seconds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/identify/data_physics.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

using estimation::Recording;

constexpr double kWindow_s = 0.5, kJoined_s = 2;  // stretches nearer to each other are one

/// Torque that a drawing may leave unexplained: part of the largest weight, friction with room for worn seals, offsets.
JointVector explained_Nm(const MachineDescription& machine, const WeightRow& row, const JointVector& largest_Nm) {
  constexpr double kShareOfWeight = 0.5, kFrictionRoom = 2, kOffset_Pa = 3e5;
  JointVector most;
  for (int j = 0; j < kJoints; ++j) {
    const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(j)];
    const FrictionDescription& friction = cylinder.friction;
    const double force_N = kFrictionRoom * (friction.coulomb_N * friction.static_ratio +
                                            friction.viscous_Ns_per_m * std::abs(row.speed_mps[j])) +
                           kOffset_Pa * cylinder.head_area_m2();
    most[j] = kShareOfWeight * largest_Nm[j] + force_N * std::abs(row.lever_m[j]);
  }
  return most;
}

/// In windows of half a second: whether the mean torque of some joint is beyond what is explained.
std::vector<bool> pushed_windows(const MachineDescription& machine, const Recording& recording) {
  const WeightRows rows(machine, recording);
  const auto length = static_cast<std::size_t>(std::max(1.0, std::round(kWindow_s / recording.step_s)));
  const std::size_t every = std::max<std::size_t>(1, length / 10);
  std::vector<std::vector<WeightRow>> windows;
  JointVector largest_Nm = JointVector::Zero();
  for (std::size_t from = 0; from + length <= recording.samples.size(); from += length) {
    auto& window = windows.emplace_back();
    for (std::size_t i = from; i < from + length; i += every) {
      const auto row = rows.at(i);
      if (!row) continue;
      window.push_back(*row);
      largest_Nm = largest_Nm.cwiseMax(row->gravity_Nm.cwiseAbs());
    }
  }
  std::vector<bool> pushed;
  for (const auto& window : windows) {
    JointVector left_Nm = JointVector::Zero(), most_Nm = JointVector::Zero();
    for (const WeightRow& row : window) {
      left_Nm += row.torque_Nm - row.gravity_Nm;
      most_Nm += explained_Nm(machine, row, largest_Nm);
    }
    pushed.push_back(!window.empty() && (left_Nm.cwiseAbs().array() > most_Nm.array()).any());
  }
  return pushed;
}

}  // namespace

std::vector<Seconds> contact_seconds(const MachineDescription& machine, const Recording& recording) {
  std::vector<Seconds> stretches;
  const std::vector<bool> pushed = pushed_windows(machine, recording);
  for (std::size_t i = 0; i < pushed.size(); ++i) {
    if (!pushed[i]) continue;
    const double from_s = kWindow_s * static_cast<double>(i);
    if (stretches.empty() || from_s - stretches.back().to_s > kJoined_s) stretches.push_back({from_s, from_s});
    stretches.back().to_s = from_s + kWindow_s;
  }
  return stretches;
}

Recording without(const std::vector<Seconds>& stretches, Recording recording) {
  for (const Seconds& stretch : stretches) {
    const auto from = static_cast<std::size_t>(stretch.from_s / recording.step_s);
    const auto to = std::min(recording.usable.size(), static_cast<std::size_t>(stretch.to_s / recording.step_s) + 1);
    std::fill(recording.usable.begin() + static_cast<std::ptrdiff_t>(from),
              recording.usable.begin() + static_cast<std::ptrdiff_t>(to), std::uint8_t{0});
  }
  return recording;
}

std::string contact_text(const std::vector<Seconds>& stretches, const Recording& recording) {
  constexpr std::size_t kNamed = 5;
  std::string list;
  double sum_s = 0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    sum_s += stretches[i].to_s - stretches[i].from_s;
    if (i < kNamed)
      list += fmt::format("{}{:.1f} to {:.1f} s", i > 0 ? ", " : "", stretches[i].from_s, stretches[i].to_s);
  }
  if (stretches.size() > kNamed) list += fmt::format(" and {} more times", stretches.size() - kNamed);
  return fmt::format(
      "seems to touch or carry something at {} ({:.0f} % of the recording): identification needs free motion", list,
      100 * sum_s / recording.duration_s());
}

}  // namespace knuckle::identify
