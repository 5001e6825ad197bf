// Fast excitation: a joint-limited Fourier series with coefficients found by search.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "estimation/identification/excitation.h"
#include "estimation/identification/path_check.h"
#include "machine/description.h"

namespace knuckle::estimation {
namespace {

constexpr double kFourierStep_s = 0.005;
constexpr double kFourierRest_s = 0.5;  ///< At both ends.
constexpr double kFade_s = 4;           ///< From rest to the full series, and back.
constexpr double kPeriod_s = 40;        ///< Of the slowest harmonic.
constexpr int kHarmonics = 22;          ///< To 0.55 Hz.
constexpr double kFastest_mps = 0.12;   ///< Cylinder speed.
constexpr double kSteepest = 1;         ///< Exponent that speeds may fall with frequency with.
constexpr int kRestarts = 100, kMoves = 300;
constexpr std::size_t kSearchPoints = 400;  ///< Of the path, looked at by the search.
constexpr std::size_t kSide = 3;            ///< Samples at a point.
using Coefficients = Eigen::Matrix<double, kJoints, 2 * kHarmonics>;

/// 0 at rest, 1 in between, with two continuous derivatives.
double fade(double t_s, double duration_s) {
  const double x = std::clamp((std::min(t_s, duration_s - t_s) - kFourierRest_s) / kFade_s, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

/// All harmonics at one time. Amplitudes fall with frequency such that each harmonic has the same speed.
Eigen::Matrix<double, 2 * kHarmonics, 1> harmonics(double t_s, double duration_s) {
  Eigen::Matrix<double, 2 * kHarmonics, 1> values;
  for (int k = 0; k < kHarmonics; ++k) {
    const double omega = 2 * std::numbers::pi * (k + 1) / kPeriod_s;
    values[2 * k] = std::sin(omega * t_s) / omega;
    values[2 * k + 1] = std::cos(omega * t_s) / omega;
  }
  return fade(t_s, duration_s) * values;
}

/// Looks at few points of a path: three samples a step apart at each, laid end to end, of which path_extremes and
/// PathCondition take the middle one with its true rates (every = kSide).
class Search {
 public:
  Search(const MachineDescription& machine, const PathRoom& room, double duration_s)
      : machine_(machine), room_(room), duration_s_(duration_s), condition_(machine, true) {
    basis_.resize(2 * kHarmonics, static_cast<Eigen::Index>(kSide * kSearchPoints));
    for (std::size_t i = 0; i < kSearchPoints; ++i) {
      const double t_s = duration_s * (static_cast<double>(i) + 0.5) / kSearchPoints;
      for (std::size_t side = 0; side < kSide; ++side) {
        const double at_s = t_s + (static_cast<double>(side) - 1) * kFourierStep_s;
        basis_.col(static_cast<Eigen::Index>(kSide * i + side)) = harmonics(at_s, duration_s);
      }
    }
  }

  /// Puts the series into the room: amplitude and middle of each joint by its range, then by speeds; by the tip's
  /// acceleration too. @return the middle, and the coefficients scaled in place.
  [[nodiscard]] JointVector fit(Coefficients& coefficients) const {
    const Eigen::Matrix<double, kJoints, Eigen::Dynamic> series = coefficients * basis_;
    const JointVector low = series.rowwise().minCoeff(), high = series.rowwise().maxCoeff();
    const JointVector gain = (room_.high_rad - room_.low_rad).cwiseQuotient(high - low);
    coefficients = gain.asDiagonal() * coefficients;
    JointVector middle = 0.5 * (room_.high_rad + room_.low_rad) - 0.5 * gain.cwiseProduct(low + high);
    for (int pass = 0; pass < 3; ++pass) {
      const PathExtremes extremes = path_extremes(machine_, points(coefficients, middle), kSide);
      // Where a joint alone is too fast it alone gives way; what they share scales all.
      const JointVector own = extremes.fastest_radps.cwiseQuotient(room_.rate_radps)
                                  .cwiseMax(extremes.fastest_cylinder_mps / kFastest_mps)
                                  .cwiseMax(JointVector::Ones());
      const double shared = std::max({1.0, extremes.flow_m3ps / room_.flow_m3ps / own.minCoeff(),
                                      extremes.tip_speed_mps / room_.tip_speed_mps / own.minCoeff(),
                                      extremes.tip_mps2 / room_.tip_mps2 / own.minCoeff()});
      const JointVector smaller = (shared * own).cwiseInverse();
      const JointVector centre = 0.5 * (room_.high_rad + room_.low_rad);
      coefficients = smaller.asDiagonal() * coefficients;
      middle = centre + smaller.cwiseProduct(middle - centre);
    }
    return middle;
  }

  /// Condition number, more for slow motion, infinite where the room is left. Scales the coefficients into the room.
  [[nodiscard]] double cost(Coefficients& coefficients) const {
    const JointVector middle = fit(coefficients);
    const JointPath seen = points(coefficients, middle);
    constexpr double kNearly = 1.02;
    const double speed_use = room_.speed_use(path_extremes(machine_, seen, kSide), kFastest_mps);
    if (speed_use > kNearly) return std::numeric_limits<double>::infinity();
    // Scaled columns would not mind a motion too slow to show inertia over noise.
    return condition_(seen, kSide) / std::min(1.0, speed_use);
  }

  /// @param amplitude a little below 1 where the points looked at have missed a peak.
  [[nodiscard]] JointPath path(Coefficients coefficients, double amplitude) const {
    const JointVector middle = fit(coefficients);
    coefficients *= amplitude;
    JointPath result{kFourierStep_s, {}};
    const auto samples = static_cast<std::size_t>(std::lround(duration_s_ / kFourierStep_s));
    for (std::size_t i = 0; i < samples; ++i) {
      result.joint_rad.emplace_back(middle +
                                    coefficients * harmonics(kFourierStep_s * static_cast<double>(i), duration_s_));
    }
    return result;
  }

 private:
  [[nodiscard]] JointPath points(const Coefficients& coefficients, const JointVector& middle) const {
    JointPath result{kFourierStep_s, {}};
    result.joint_rad.reserve(kSide * kSearchPoints);
    for (Eigen::Index i = 0; i < basis_.cols(); ++i) {
      result.joint_rad.emplace_back(middle + coefficients * basis_.col(i));
    }
    return result;
  }

  MachineDescription machine_;
  PathRoom room_;
  double duration_s_;
  PathCondition condition_;
  Eigen::Matrix<double, 2 * kHarmonics, Eigen::Dynamic> basis_;
};

/// Two normal values (Box and Muller), the same on every platform.
std::array<double, 2> normal_pair(PathRandom& random) {
  const double radius = std::sqrt(-2 * std::log(1 - uniform(random, 0, 1)));
  const double angle = uniform(random, 0, 2 * std::numbers::pi);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

void disturb(Coefficients& coefficients, double size, PathRandom& random) {
  for (int k = 0; k < kHarmonics; ++k) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto [a, b] = normal_pair(random);
      coefficients(joint, 2 * k) += size * a;
      coefficients(joint, 2 * k + 1) += size * b;
    }
  }
}

/// Random restarts, then moves from the best whose size grows with success and shrinks with failure (the 1/5 rule).
Coefficients search(const Search& space, PathRandom& random) {
  Coefficients best = Coefficients::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (int restart = 0; restart < kRestarts; ++restart) {
    Coefficients candidate = Coefficients::Zero();
    disturb(candidate, 1, random);
    for (int joint = 0; joint < kJoints; ++joint) {
      const double slope = uniform(random, 0, kSteepest);
      for (int k = 0; k < 2 * kHarmonics; ++k) candidate(joint, k) *= std::pow(1 + k / 2, -slope);
    }
    if (const double cost = space.cost(candidate); restart == 0 || cost < least) {
      least = cost;
      best = candidate;
    }
  }
  double size = 0.2;
  for (int move = 0; move < kMoves; ++move) {
    Coefficients candidate = best;
    const double scale = best.norm() / std::sqrt(static_cast<double>(best.size()));
    disturb(candidate, size * scale, random);
    const double cost = space.cost(candidate);
    size *= cost < least ? 1.5 : 0.9;
    if (cost < least) {
      least = cost;
      best = candidate;
    }
  }
  return best;
}

}  // namespace

JointPath fast_excitation(const MachineDescription& machine, double duration_s, std::uint64_t seed) {
  const Search space(machine, PathRoom(machine), duration_s);
  PathRandom random(seed);
  const Coefficients best = search(space, random);
  std::vector<std::string> violations;
  for (const double amplitude : {1.0, 0.96, 0.92, 0.85}) {
    JointPath path = space.path(best, amplitude);
    violations = check_path(machine, path);
    if (violations.empty()) return path;
  }
  throw InputError(machine.source + ": fast motion cannot be driven: " + violations.front());
}

}  // namespace knuckle::estimation
