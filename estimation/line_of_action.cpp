#include "estimation/line_of_action.h"

#include <algorithm>
#include <cmath>

#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::estimation {
namespace {

constexpr double kLeastSigmas = 3;     // of the force, before it has a line
constexpr double kPulledShare = 0.05;  // of contacts: something hooked or caught pulls
constexpr double kLeastSpread_Nm = 1e-6;

bool has_line(const BucketLoad& load) noexcept {
  const double size_N = load.force_N.norm();
  const double along_N2 = load.force_N.dot(load.covariance_N2 * load.force_N);
  return size_N > 0 && size_N * size_N * size_N * size_N > kLeastSigmas * kLeastSigmas * along_N2;
}

double below(double mean, double sigma) noexcept {
  return 0.5 * std::erfc(mean / (sigma * std::sqrt(2.0)));
}

}  // namespace

/// offset = -torque / |force|, so d offset = -(d torque + offset d|force|) / |force|.
LineOfAction line_of_action(const BucketLoad& load) noexcept {
  if (!has_line(load)) return {};
  const double size_N = load.force_N.norm();
  const PlanarVector unit = load.force_N / size_N;
  const double offset_m = -load.torque_Nm / size_N;
  const double variance = load.torque_variance_N2m2 + 2 * offset_m * unit.dot(load.covariance_N2m) +
                          offset_m * offset_m * unit.dot(load.covariance_N2 * unit);
  return {offset_m, std::sqrt(std::max(0.0, variance)) / size_N};
}

TouchedSides::TouchedSides(const MachineDescription& machine) noexcept {
  const auto outline = bucket_outline(machine);
  for (std::size_t i = 0; i < kBucketSides; ++i) corners_from_tip_m_[i] = outline[i] - outline[0];
}

/// Corner r is to the left of the line where m = torque - r x force is positive. Counter-clockwise along the outline
/// the line comes in where the corners change from its left to its right, and goes out where they change back.
std::array<double, kBucketSides> TouchedSides::shares(const JointVector& joints_rad,
                                                      const BucketLoad& load) const noexcept {
  std::array<double, kBucketSides> shares{};
  if (!has_line(load)) return shares;
  const Eigen::Rotation2Dd to_machine(joints_rad.sum());
  std::array<double, kBucketSides> right{};  // probability that the corner is to the right of the line
  for (std::size_t i = 0; i < kBucketSides; ++i) {
    const PlanarVector r = to_machine * corners_from_tip_m_[i];
    const PlanarVector arm(-r.y(), r.x());
    const double mean = load.torque_Nm - arm.dot(load.force_N);
    const double variance =
        load.torque_variance_N2m2 - 2 * arm.dot(load.covariance_N2m) + arm.dot(load.covariance_N2 * arm);
    right[i] = below(mean, std::max(kLeastSpread_Nm, std::sqrt(std::max(0.0, variance))));
  }
  for (std::size_t i = 0; i < kBucketSides; ++i) {
    const double change = right[(i + 1) % kBucketSides] - right[i];
    shares[i] = change > 0 ? (1 - kPulledShare) * change : kPulledShare * -change;
  }
  return shares;
}

}  // namespace knuckle::estimation
