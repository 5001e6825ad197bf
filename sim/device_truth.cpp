#include "sim/device_truth.h"

#include <cmath>
#include <numbers>
#include <random>

#include "core/seed.h"

namespace knuckle::sim {

DeviceTruth sample_device(const DeviceDescription& nominal, Family family, std::uint64_t seed) {
  DeviceTruth truth(nominal);
  if (family == Family::kSmooth) return truth;
  constexpr double kDegree = std::numbers::pi / 180, kTurn = 2 * std::numbers::pi;
  const bool worn = family == Family::kWorn;
  std::mt19937_64 random(stream_seed(seed, Stream::kDevice));
  const auto within = [&random](double bound) { return bound * (2 * unit_interval(random) - 1); };
  for (std::size_t i = 0; i < kJoints; ++i) {
    truth.built.torque_constant_Nm_per_A[i] *= 1 + within(worn ? 0.1 : 0.03);
    const double counts_per_rad = nominal.gear_ratio[i] * nominal.counts_per_turn[i] / kTurn;
    truth.built.zero_counts[i] +=
        static_cast<std::int32_t>(std::lround(counts_per_rad * within((worn ? 0.5 : 0.1) * kDegree)));
    if (!worn) continue;
    truth.built.friction_Nm[i] *= std::pow(5, unit_interval(random));
    truth.built.cogging_Nm[i] *= 1 + 2 * unit_interval(random);
    truth.backlash_rad[static_cast<Eigen::Index>(i)] = 0.3 * kDegree * unit_interval(random);
  }
  return truth;
}

}  // namespace knuckle::sim
