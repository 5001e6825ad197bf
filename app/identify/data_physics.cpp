#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "app/identify/data_check.h"
#include "estimation/regressor.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

using estimation::Measurement;
using estimation::Recording;

constexpr double kEvery_s = 0.05;     // one sample so often is enough of a motion below 1 Hz
constexpr double kLeast_s = 10;       // of motion, to judge by
constexpr double kRateSpan_s = 0.05;  // for differences
constexpr double kMean_s = 1;         // over it inertia averages out, and so does an arm that swings
constexpr double kLeastRatio = 0.4, kMostRatio = 2.5, kMostError = 0.7;
constexpr double kBucketRoom = 1.6;  // its weight hardly outweighs its cylinder's friction
constexpr double kPsi_Pa = 6894.757293168;

double clear_sign(double speed_mps) {
  constexpr double kStill_mps = 2e-3;
  return std::abs(speed_mps) < kStill_mps ? 0.0 : std::copysign(1.0, speed_mps);
}

/// One joint, sample by sample, gathered into means.
struct Means {
  Eigen::Vector4d columns = Eigen::Vector4d::Zero();
  double torque_Nm = 0, lever_m = 0, count = 0;
};

/// Normal equations of one joint: gravity torque, lever sgn v, lever v, lever.
struct Sums {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double torque2 = 0, gravity2 = 0, lever2 = 0;
  double shortest_m = 1e9, longest_m = 0, samples = 0;
  Means gathered;

  void gather(const Eigen::Vector4d& columns, double torque_Nm, double lever_m, double length_m) {
    gathered.columns += columns;
    gathered.torque_Nm += torque_Nm;
    gathered.lever_m += lever_m;
    ++gathered.count;
    ++samples;
    shortest_m = std::min(shortest_m, length_m);
    longest_m = std::max(longest_m, length_m);
  }
  /// Square of the torque that is not explained so.
  [[nodiscard]] double left(const Eigen::Vector4d& found) const {
    return std::max(0.0, torque2 - 2 * found.dot(right) + found.dot(normal * found));
  }
  /// The mean of what was gathered counts as so many samples.
  void close() {
    const double count = gathered.count;
    if (count == 0) return;
    const Eigen::Vector4d columns = gathered.columns / count;
    const double torque_Nm = gathered.torque_Nm / count, lever_m = gathered.lever_m / count;
    normal += count * columns * columns.transpose();
    right += count * torque_Nm * columns;
    torque2 += count * torque_Nm * torque_Nm;
    gravity2 += count * columns[0] * columns[0];
    lever2 += count * lever_m * lever_m;
    gathered = {};
  }
};

bool moved_about(const Sums& s, const CylinderDescription& cylinder) {
  constexpr double kTravel = 0.1;
  return s.longest_m - s.shortest_m > kTravel * (cylinder.max_length_m - cylinder.min_length_m);
}
/// Share of the weight, friction, and what transmitters are off by: that much of a bucket's weight they may well be,
/// but not any force.
Eigen::Vector4d balance(const Sums& s, const CylinderDescription& cylinder) {
  constexpr double kOffset_Pa = 3e5, kUsualError = 0.3;  // the latter of the weight, to compare with
  const double offset_N = kOffset_Pa * cylinder.head_area_m2();
  Eigen::Matrix4d normal = s.normal;
  normal(3, 3) += kUsualError * kUsualError * s.gravity2 / (offset_N * offset_N);
  return normal.completeOrthogonalDecomposition().solve(s.right);
}
/// At rest in one pose friction may hold any part of the weight.
bool tells(const Sums& s, const CylinderDescription& cylinder) {
  constexpr double kOutweighs = 3;
  const double held_N = cylinder.friction.coulomb_N * cylinder.friction.static_ratio;
  return moved_about(s, cylinder) || s.gravity2 > kOutweighs * kOutweighs * held_N * held_N * s.lever2;
}
bool long_enough(const Sums& s) {
  return s.samples * kEvery_s >= kLeast_s;
}

std::size_t steps(const Recording& recording, double s) {
  return static_cast<std::size_t>(std::max(1.0, std::round(s / recording.step_s)));
}

void swap_channels(Recording& recording, std::size_t a, std::size_t b) {
  for (Measurement& m : recording.samples) std::swap(recordings::signal(m, a), recordings::signal(m, b));
}

void scale_channel(Recording& recording, std::size_t channel, double factor) {
  for (Measurement& m : recording.samples) recordings::signal(m, channel) *= factor;
}

struct Hypothesis {
  Relabelling relabelling;
  std::function<void(Recording&)> apply;
};

/// Of the channels that the machine measures.
std::vector<Hypothesis> hypotheses(const MachineDescription& machine) {
  std::vector<Hypothesis> all;
  const auto measured = [&](std::size_t c) { return recordings::measures(machine, c); };
  const auto swapped = [&](std::vector<std::size_t> pairs) {
    if (!std::all_of(pairs.begin(), pairs.end(), measured)) return;
    all.push_back({{pairs, "look swapped"}, [pairs](Recording& r) {
                     for (std::size_t i = 0; i + 1 < pairs.size(); i += 2) swap_channels(r, pairs[i], pairs[i + 1]);
                   }});
  };
  for (std::size_t j = 0; j < kJoints; ++j) swapped({2 * j, 2 * j + 1});
  for (std::size_t a = 0; a < kJoints; ++a) {
    for (std::size_t b = a + 1; b < kJoints; ++b) {
      swapped({recordings::kPressureChannels + a, recordings::kPressureChannels + b});
      swapped({2 * a, 2 * b, 2 * a + 1, 2 * b + 1});
    }
  }
  for (std::size_t a = 0; a < recordings::kPressureChannels; ++a) {
    for (std::size_t b = a + 1; b < recordings::kPressureChannels; ++b) {
      if (a / 2 != b / 2) swapped({a, b});
    }
  }
  const auto scaled = [&](std::vector<std::size_t> channels, double factor, const char* what) {
    std::erase_if(channels, [&](std::size_t c) { return !measured(c); });
    if (channels.empty()) return;
    all.push_back({{channels, what}, [channels, factor](Recording& r) {
                     for (const std::size_t c : channels) scale_channel(r, c, factor);
                   }});
  };
  // What was written with which unit in mind, and what it was read as.
  constexpr std::array<std::pair<double, const char*>, 10> kUnits{{{1e5, "looks like bar taken as Pa"},
                                                                   {1e6, "looks like MPa taken as Pa"},
                                                                   {1e3, "looks like kPa taken as Pa"},
                                                                   {kPsi_Pa, "looks like psi taken as Pa"},
                                                                   {kPsi_Pa / 1e5, "looks like psi taken as bar"},
                                                                   {10, "looks like MPa taken as bar"},
                                                                   {1e-5, "looks like Pa taken as bar"},
                                                                   {1e-2, "looks like kPa taken as bar"},
                                                                   {1e5 / kPsi_Pa, "looks like bar taken as psi"},
                                                                   {-1, "has the wrong sign"}}};
  for (const auto& [factor, what] : kUnits) {
    scaled({0, 1, 2, 3, 4, 5}, factor, what);
    for (std::size_t j = 0; j < kJoints; ++j) scaled({2 * j, 2 * j + 1}, factor, what);
    for (std::size_t c = 0; c < recordings::kPressureChannels; ++c) scaled({c}, factor, what);
  }
  scaled({recordings::kSignalChannels - 1}, -1, "has the wrong sign");
  return all;
}

}  // namespace

WeightRows::WeightRows(const MachineDescription& machine, const Recording& recording)
    : machine_(machine),
      recording_(recording),
      kinematics_(machine),
      nominal_(estimation::lumped_parameters(machine)),
      reach_(steps(recording, kRateSpan_s / 2)) {}

std::optional<WeightRow> WeightRows::at(std::size_t i) const {
  if (i < reach_ || i + reach_ >= recording_.samples.size() || recording_.usable[i] == 0 ||
      recording_.usable[i - reach_] == 0 || recording_.usable[i + reach_] == 0)
    return std::nullopt;
  const Measurement &now = recording_.samples[i], &before = recording_.samples[i - reach_],
                    &after = recording_.samples[i + reach_];
  WeightRow row;
  JointVector angle;
  for (int j = 0; j < kJoints; ++j) {
    const auto joint = static_cast<std::size_t>(j);
    const auto theta = kinematics_.joint_at(j, now.cylinder_m[j] - machine_.sensors.encoder_offset_m[j]);
    if (!theta) return std::nullopt;
    angle[j] = *theta;
    row.lever_m[j] = kinematics_.cylinder_at(j, *theta)->lever_m;
    const CylinderDescription& cylinder = machine_.cylinders[joint];
    row.torque_Nm[j] = std::numeric_limits<double>::quiet_NaN();
    if (j == machine_.sensors.without_pressures) continue;
    row.torque_Nm[j] = row.lever_m[j] * (now.pressure_Pa[2 * joint] * cylinder.head_area_m2() -
                                         now.pressure_Pa[2 * joint + 1] * cylinder.rod_side_area_m2());
  }
  row.speed_mps = (after.cylinder_m - before.cylinder_m) / (recording_.step_s * static_cast<double>(2 * reach_));
  row.gravity_Nm =
      estimation::joint_torque(estimation::RigidArm::gravity(estimation::Pose(angle, now.hull_pitch_rad)) * nominal_);
  return row;
}

bool WeightFit::believable(int joint) const {
  if (!decisive[static_cast<std::size_t>(joint)]) return true;
  const double room = joint == kBucket ? kBucketRoom : 1;
  return ratio[joint] > kLeastRatio / room && ratio[joint] < kMostRatio * room && error[joint] < kMostError * room;
}

double WeightFit::common_scale() const {
  constexpr double kAlike = 0.1, kOff = 0.15;  // sampled machines with masses 5 % off have means within 0.93 and 1.05
  if (!std::all_of(decisive.begin(), decisive.end(), [](bool d) { return d; }) || ratio.minCoeff() <= 0) return 1;
  const double mean = std::cbrt(ratio.prod());
  const bool alike = ((ratio / mean).array() - 1).abs().maxCoeff() < kAlike;
  return alike && std::abs(mean - 1) > kOff ? mean : 1;
}

double WeightFit::misfit() const {
  double sum = 0;
  for (int j = 0; j < kJoints; ++j) {
    constexpr double kWrongSign = 5;
    sum += (ratio[j] > 0 ? std::min(kWrongSign, std::abs(std::log(ratio[j]))) : kWrongSign) + std::min(5.0, error[j]);
  }
  return sum;
}

WeightFit weigh(const MachineDescription& machine, const Recording& recording) {
  const WeightRows rows(machine, recording);
  const std::size_t every = steps(recording, kEvery_s);
  // While a rod stands its friction may be anything up to breakaway: where it has moved enough, that alone tells.
  std::array<Sums, kJoints> all, moving;
  WeightFit fit;
  const std::size_t instants_in_mean = steps(recording, kMean_s) / every;
  std::size_t gathered = 0;
  const auto close = [&] {
    for (std::array<Sums, kJoints>* sums : {&all, &moving}) {
      for (Sums& s : *sums) s.close();
    }
    gathered = 0;
  };
  for (std::size_t i = steps(recording, kRateSpan_s / 2); i < recording.samples.size(); i += every) {
    const std::optional<WeightRow> row = rows.at(i);
    if (!row || gathered >= instants_in_mean) close();
    if (!row) continue;
    ++fit.samples;
    ++gathered;
    for (int j = 0; j < kJoints; ++j) {
      if (j == machine.sensors.without_pressures) continue;
      const auto joint = static_cast<std::size_t>(j);
      const double sign = clear_sign(row->speed_mps[j]);
      const double lever_m = row->lever_m[j];
      const Eigen::Vector4d columns(row->gravity_Nm[j], lever_m * sign, lever_m * row->speed_mps[j], lever_m);
      all[joint].gather(columns, row->torque_Nm[j], row->lever_m[j], recording.samples[i].cylinder_m[j]);
      if (sign != 0)
        moving[joint].gather(columns, row->torque_Nm[j], row->lever_m[j], recording.samples[i].cylinder_m[j]);
    }
  }
  close();
  for (int j = 0; j < kJoints && fit.samples > 0; ++j) {
    if (j == machine.sensors.without_pressures) {
      fit.ratio[j] = 1;
      continue;
    }
    const auto joint = static_cast<std::size_t>(j);
    const CylinderDescription& cylinder = machine.cylinders[joint];
    const Sums& s = long_enough(moving[joint]) && moved_about(moving[joint], cylinder) ? moving[joint] : all[joint];
    const Eigen::Vector4d found = balance(s, cylinder);
    fit.ratio[j] = found[0];
    fit.decisive[joint] = long_enough(s) && tells(s, cylinder);
    fit.error[j] = std::sqrt(s.left(found) / s.gravity2);
  }
  return fit;
}

std::optional<Relabelling> better_reading(const MachineDescription& machine, const Recording& recording) {
  std::optional<Relabelling> best;
  // A coarser recording separates labels as well and keeps this quick.
  const auto every = static_cast<std::size_t>(std::max(1.0, std::floor(kRateSpan_s / 2 / recording.step_s)));
  const Recording coarse = estimation::decimated(recording, every);
  const WeightFit labelled = weigh(machine, coarse);
  constexpr double kClearlyBetter = 0.6;
  double least = labelled.samples > 0 ? kClearlyBetter * labelled.misfit() : 1e9;
  for (const Hypothesis& hypothesis : hypotheses(machine)) {
    Recording read = coarse;
    hypothesis.apply(read);
    const WeightFit fit = weigh(machine, read);
    if (fit.samples == 0 || fit.samples < labelled.samples || fit.misfit() >= least) continue;
    least = fit.misfit();
    best = hypothesis.relabelling;
  }
  return best;
}

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
