// Ranges of limb impedance (see the operator's part of the stability battery) and how they are sampled.
#include "sim/operator_limb.h"

#include <cmath>
#include <random>

#include "core/seed.h"

namespace knuckle::sim {
namespace {

struct Range {
  double low, high;
};
struct LimbRanges {
  Range mass, damping, stiffness;
};

LimbRanges ranges_of(LimbClass limb) noexcept {
  switch (limb) {
    case LimbClass::kRelaxed:
      return {{0.5, 2.0}, {5, 20}, {60, 500}};
    case LimbClass::kNormal:
      return {{0.75, 2.0}, {10, 30}, {200, 700}};
    case LimbClass::kCoContracted:
      return {{1.0, 2.5}, {20, 40}, {500, 1000}};
    case LimbClass::kLightGrip:
      return {{0.05, 0.5}, {0.3, 5}, {5, 60}};
  }
  return {};
}
constexpr Range kWristInertia{2e-3, 5e-3}, kWristDamping{0.02, 0.1}, kWristStiffness{1, 10};

}  // namespace

const char* name(LimbClass limb) noexcept {
  switch (limb) {
    case LimbClass::kRelaxed:
      return "relaxed";
    case LimbClass::kNormal:
      return "normal";
    case LimbClass::kCoContracted:
      return "co_contracted";
    case LimbClass::kLightGrip:
      return "light_grip";
  }
  return "?";
}

LimbImpedance sample_limb(LimbClass limb, std::uint64_t seed) noexcept {
  std::mt19937_64 random(seed);
  const auto sample = [&random](Range range) {
    return range.low * std::pow(range.high / range.low, unit_interval(random));
  };
  const LimbRanges ranges = ranges_of(limb);
  LimbImpedance sampled;
  sampled.mass_kg = sample(ranges.mass);
  sampled.damping_Ns_per_m = sample(ranges.damping);
  sampled.stiffness_N_per_m = sample(ranges.stiffness);
  sampled.wrist_inertia_kgm2 = sample(kWristInertia);
  sampled.wrist_damping_Nms = sample(kWristDamping);
  sampled.wrist_stiffness_Nm = sample(kWristStiffness);
  return sampled;
}

}  // namespace knuckle::sim
