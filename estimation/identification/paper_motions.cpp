#include "estimation/identification/paper_motions.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/error.h"
#include "estimation/identification/path_check.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

constexpr double kPaperStep_s = 0.005;
constexpr double kMotionShare = 0.8;      // of pump flow, joint rates and tip speed
constexpr double kSlowMotion_mps = 0.03;  // K's "slow motion"
constexpr double kRamp_s = 0.5;           // to full speed in a slow sweep
constexpr double kEndMargin_m = 0.02;     // rods stay away from their end stops

/// How far along a move, [0, 1] over time [0, 1].
double minimum_jerk(double s) {
  return s * s * s * (10 - 15 * s + 6 * s * s);
}

/// Paths put together from moves in rod lengths, where speed limits live.
class RodPath {
 public:
  RodPath(const MachineDescription& machine, const JointVector& start_rad)
      : machine_(machine), kinematics_(machine), at_rad_(start_rad), path_{kPaperStep_s, {start_rad}} {}

  void hold(double duration_s) {
    path_.joint_rad.insert(path_.joint_rad.end(), static_cast<std::size_t>(std::lround(duration_s / kPaperStep_s)),
                           at_rad_);
  }
  /// @param from, to part of the move, [0, 1], in which each joint moves. At least least_s, longer where limits ask so.
  void move(const JointVector& to_rad, double least_s, const JointVector& from = JointVector::Zero(),
            const JointVector& to = JointVector::Ones()) {
    const auto progress = [&](int joint, double s) {
      return minimum_jerk(std::clamp((s - from[joint]) / (to[joint] - from[joint]), 0.0, 1.0));
    };
    append(sampled(to_rad, std::max(least_s, kShortest_s), progress));
  }
  /// One joint at constant rod speed but for ramps.
  void sweep(int joint, double to_rad, double speed_mps) {
    JointVector goal = at_rad_;
    goal[joint] = to_rad;
    const double way_m = std::abs(length(joint, to_rad) - length(joint, at_rad_[joint]));
    const double ramp = kRamp_s / (way_m / speed_mps + kRamp_s);  // of the whole time
    const auto progress = [ramp](int, double s) {
      const double top = 1 / (1 - ramp);
      const auto rising = [&](double t) { return t < ramp ? top * t * t / (2 * ramp) : top * (t - ramp / 2); };
      return s < 1 - ramp ? rising(s) : 1 - rising(1 - s);
    };
    append(sampled(goal, way_m / speed_mps + kRamp_s, progress));
  }
  [[nodiscard]] double duration_s() const { return path_.duration_s(); }
  [[nodiscard]] JointPath take() { return std::move(path_); }
  /// Takes back what came after; the path then stands where it stood.
  void cut(std::size_t samples) {
    path_.joint_rad.resize(samples);
    at_rad_ = path_.joint_rad.back();
  }
  [[nodiscard]] std::size_t size() const { return path_.joint_rad.size(); }

 private:
  static constexpr double kShortest_s = 0.5;

  [[nodiscard]] double length(int joint, double joint_rad) const {
    return kinematics_.cylinder_at(joint, joint_rad)->length_m;
  }
  template <typename P>
  [[nodiscard]] std::vector<JointVector> sampled(const JointVector& to_rad, double duration_s,
                                                 const P& progress) const {
    double stretch = 1;
    for (;;) {
      std::vector<JointVector> moved = at_speed(to_rad, stretch * duration_s, progress);
      const double excess = worst_share(moved) / kMotionShare;
      if (excess <= 1) return moved;
      stretch *= 1.001 * excess;
    }
  }
  template <typename P>
  [[nodiscard]] std::vector<JointVector> at_speed(const JointVector& to_rad, double duration_s,
                                                  const P& progress) const {
    const auto count = static_cast<std::size_t>(std::ceil(duration_s / kPaperStep_s));
    std::vector<JointVector> moved(count);
    for (int joint = 0; joint < kJoints; ++joint) {
      const double first_m = length(joint, at_rad_[joint]), last_m = length(joint, to_rad[joint]);
      for (std::size_t i = 0; i < count; ++i) {
        const double s = static_cast<double>(i + 1) / static_cast<double>(count);
        moved[i][joint] = *kinematics_.joint_at(joint, first_m + progress(joint, s) * (last_m - first_m));
      }
    }
    return moved;
  }
  /// Largest of flow, joint rate and tip speed, each as a share of what the machine file allows.
  [[nodiscard]] double worst_share(const std::vector<JointVector>& moved) const {
    double worst = 0;
    JointVector before = at_rad_;
    for (const JointVector& now : moved) {
      double flow = 0;
      for (int joint = 0; joint < kJoints; ++joint) {
        const auto k = static_cast<std::size_t>(joint);
        const double rate = std::abs(now[joint] - before[joint]) / kPaperStep_s;
        const double speed = std::abs(length(joint, now[joint]) - length(joint, before[joint])) / kPaperStep_s;
        flow += speed * machine_.cylinders[k].head_area_m2();
        if (machine_.links[k].max_rate_radps > 0) worst = std::max(worst, rate / machine_.links[k].max_rate_radps);
      }
      if (machine_.hydraulics.pump_flow_m3ps > 0) worst = std::max(worst, flow / machine_.hydraulics.pump_flow_m3ps);
      const double tip_mps = (kinematics_.tip(now) - kinematics_.tip(before)).norm() / kPaperStep_s;
      if (machine_.limits.tip_speed_mps > 0) worst = std::max(worst, tip_mps / machine_.limits.tip_speed_mps);
      before = now;
    }
    return worst;
  }
  void append(const std::vector<JointVector>& moved) {
    path_.joint_rad.insert(path_.joint_rad.end(), moved.begin(), moved.end());
    at_rad_ = path_.joint_rad.back();
  }

  const MachineDescription& machine_;
  Kinematics kinematics_;
  JointVector at_rad_;
  JointPath path_;
};

/// Joint angles that both the joint's range and the cylinder's stroke leave room around.
struct Reach {
  explicit Reach(const MachineDescription& machine) {
    constexpr double kMargin_rad = 0.05;
    const Kinematics kinematics(machine);
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto k = static_cast<std::size_t>(joint);
      const CylinderDescription& cylinder = machine.cylinders[k];
      const double margin = machine.limits.joint_soft_margin_rad + kMargin_rad;
      std::array<double, 2> ends{machine.links[k].min_rad + margin, machine.links[k].max_rad - margin};
      for (double& end : ends) {
        const double length_m = std::clamp(kinematics.cylinder_at(joint, end)->length_m,
                                           cylinder.min_length_m + kEndMargin_m, cylinder.max_length_m - kEndMargin_m);
        end = *kinematics.joint_at(joint, length_m);
      }
      low[joint] = ends[0];
      high[joint] = ends[1];
    }
  }
  /// @param share of the range, 0 lowest, 1 highest angle.
  [[nodiscard]] JointVector at(const JointVector& share) const { return low + share.cwiseProduct(high - low); }
  JointVector low, high;
};

class Sampler {
 public:
  explicit Sampler(std::uint64_t seed) : generator_(seed) {}
  double within(double low, double high) { return uniform(generator_, low, high); }
  JointVector about(const JointVector& centre, double bound) {
    JointVector value = centre;
    for (double& v : value) v = std::clamp(v + within(-bound, bound), 0.0, 1.0);
    return value;
  }
  JointVector vector(double low, double high) {
    const double a = within(low, high), b = within(low, high), c = within(low, high);
    return {a, b, c};
  }

 private:
  std::mt19937_64 generator_;
};

constexpr double kPause_s = 0.8;

}  // namespace

JointPath kim_slow_motion(const MachineDescription& machine) {
  const Reach reach(machine);
  RodPath path(machine, reach.at({0.5, 0.5, 0.5}));
  for (const int joint : {kBucket, kArm, kBoom}) {
    const double middle = (reach.low[joint] + reach.high[joint]) / 2;
    for (const double to : {reach.high[joint], reach.low[joint], middle}) {
      path.sweep(joint, to, kSlowMotion_mps);
      path.hold(kPause_s);
    }
  }
  return path.take();
}

JointPath kim_verification_1(const MachineDescription& machine) {
  const Reach reach(machine);
  RodPath path(machine, reach.at({0.6, 0.2, 0.8}));
  path.hold(kPause_s);
  for (const auto& [arm, bucket] : {std::pair{0.8, 0.3}, {0.4, 0.7}, {0.7, 0.2}, {0.2, 0.8}}) {
    path.move(reach.at({0.6, arm, bucket}), 7);
    path.hold(kPause_s);
  }
  return path.take();
}

JointPath kim_verification_2(const MachineDescription& machine) {
  const Reach reach(machine);
  RodPath path(machine, reach.at({0.4, 0.3, 0.7}));
  path.hold(kPause_s);
  const std::array<JointVector, 6> shares{JointVector(0.7, 0.4, 0.6),  {0.5, 0.5, 0.4},    {0.8, 0.7, 0.3},
                                          JointVector(0.55, 0.6, 0.5), {0.75, 0.45, 0.65}, {0.4, 0.3, 0.7}};
  for (int round = 0; round < 2; ++round) {
    for (const JointVector& share : shares) {
      path.move(reach.at(share), 2.5);
      path.hold(0.3);
    }
  }
  return path.take();
}

JointPath malaguti_dig_like_motion(const MachineDescription& machine, std::uint64_t seed) {
  constexpr double kWhole_s = 40;
  // Shares of the range (boom, arm, bucket; 0 is down, drawn in, curled in): reach out, set down, drag, curl, lift,
  // dump.
  const std::array<JointVector, 6> cycle{JointVector(0.5, 0.8, 0.8),   {0.3, 0.75, 0.75}, {0.3, 0.45, 0.6},
                                         JointVector(0.35, 0.3, 0.25), {0.65, 0.4, 0.25}, {0.6, 0.7, 0.7}};
  const Reach reach(machine);
  Sampler sampler(seed);
  RodPath path(machine, reach.at(cycle.back()));
  for (std::size_t n = 0;; ++n) {
    const std::size_t before = path.size();
    const JointVector from = sampler.vector(0, 0.25), to = sampler.vector(0.75, 1);
    path.move(reach.at(sampler.about(cycle[n % cycle.size()], 0.1)), 1.5, from, to);
    if (path.duration_s() > kWhole_s) {
      path.cut(before);
      break;
    }
  }
  path.hold(kWhole_s - path.duration_s());
  return path.take();
}

std::vector<JointVector> static_poses(const MachineDescription& machine, int count, std::uint64_t seed) {
  if (count < 1) throw InputError("static_poses: " + std::to_string(count) + " poses; at least 1 is needed");
  const Reach reach(machine);
  Sampler sampler(seed);
  std::vector<JointVector> poses;
  for (int i = 0; i < count; ++i) poses.push_back(reach.at(sampler.vector(0, 1)));
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const auto from = poses.begin() + static_cast<std::ptrdiff_t>(i);
    const auto nearer = [&](const JointVector& a, const JointVector& b) {
      return (a - *from).squaredNorm() < (b - *from).squaredNorm();
    };
    std::iter_swap(from + 1, std::min_element(from + 1, poses.end(), nearer));
  }
  return poses;
}

}  // namespace knuckle::estimation
