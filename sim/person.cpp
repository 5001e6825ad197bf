// Ranges of limb impedance (see the operator's part of the stability battery) and how they are sampled.
#include "sim/person.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/seed.h"

namespace knuckle::sim {
namespace {

struct LimbRange {
  double low, high;
};
struct LimbOfClass {
  const char* name;
  LimbRange mass_kg, damping_Ns_per_m, stiffness_N_per_m;
  double sustained_N, strength_N;
};
/// In the order of LimbClass.
constexpr std::array<LimbOfClass, 4> kLimbs{{{"relaxed", {0.5, 2.0}, {5, 20}, {60, 500}, 4, 15},
                                             {"normal", {0.75, 2.0}, {10, 30}, {200, 700}, 7, 40},
                                             {"co_contracted", {1.0, 2.5}, {20, 40}, {500, 1000}, 12, 60},
                                             {"light_grip", {0.05, 0.5}, {0.3, 5}, {5, 60}, 2, 4}}};
const LimbOfClass& of_class(LimbClass limb) noexcept {
  return kLimbs[static_cast<std::size_t>(limb)];
}
constexpr LimbRange kWristInertia{2e-3, 5e-3}, kWristDamping{0.02, 0.1}, kWristStiffness{1, 10};

}  // namespace

const char* name(LimbClass limb) noexcept {
  return of_class(limb).name;
}

double sustained_N(LimbClass limb) noexcept {
  return of_class(limb).sustained_N;
}

double strength_N(LimbClass limb) noexcept {
  return of_class(limb).strength_N;
}

LimbImpedance sample_limb(LimbClass limb, std::uint64_t seed) noexcept {
  std::mt19937_64 random(seed);
  const auto sample = [&random](LimbRange range) {
    return range.low * std::pow(range.high / range.low, unit_interval(random));
  };
  const LimbOfClass& ranges = of_class(limb);
  LimbImpedance sampled;
  sampled.mass_kg = sample(ranges.mass_kg);
  sampled.damping_Ns_per_m = sample(ranges.damping_Ns_per_m);
  sampled.stiffness_N_per_m = sample(ranges.stiffness_N_per_m);
  sampled.wrist_inertia_kgm2 = sample(kWristInertia);
  sampled.wrist_damping_Nms = sample(kWristDamping);
  sampled.wrist_stiffness_Nm = sample(kWristStiffness);
  return sampled;
}

namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;
constexpr double kTremorBand_Hz = 1;  // either way: it wanders
constexpr double kShortestWave_s = 7, kLongestWave_s = 31;

/// Force on a free limb's fingertip that shakes it by so much at this frequency.
double force_of_tremor_N(const LimbImpedance& limb, double tremor_m, double tremor_Hz) {
  const double w = kWholeTurn * tremor_Hz;
  const std::complex<double> impedance(limb.stiffness_N_per_m - limb.mass_kg * w * w, limb.damping_Ns_per_m * w);
  return tremor_m * std::abs(impedance);
}

}  // namespace

const char* name(PersonClass person) noexcept {
  switch (person) {
    case PersonClass::kExact:
      return "exact";
    case PersonClass::kSteady:
      return "steady";
    case PersonClass::kRough:
      return "rough";
  }
  return "?";
}

Person sample_person(PersonClass person, std::uint64_t seed) noexcept {
  Person sampled;
  if (person == PersonClass::kExact) return sampled;
  std::mt19937_64 random(stream_seed(seed, Stream::kPerson));
  const auto within = [&random](double low, double high) { return low + (high - low) * unit_interval(random); };
  const bool rough = person == PersonClass::kRough;
  sampled.corrects = true;
  sampled.tremor_Hz = within(7, 11);
  sampled.tremor_m = rough ? within(0.1e-3, 0.25e-3) : within(0.02e-3, 0.05e-3);
  sampled.drift_radps = rough ? within(1.5e-3, 4e-3) : within(0.3e-3, 1e-3);
  sampled.give_way = rough ? within(0.2, 0.4) : within(0.05, 0.2);
  sampled.give_way_s = within(10, 20);
  sampled.slips_per_s = rough ? 1 / within(60, 180) : 0;
  return sampled;
}

double correction_1ps(Duration reaction) noexcept {
  constexpr double kOwn_s = 0.15;
  return kWholeTurn * 0.16 / std::pow(std::max(to_seconds(reaction), kOwn_s), 0.85);
}

double steady_below_1ps(const LimbImpedance& limb) noexcept {
  constexpr double kDevice_kg = 0.1;  // about what links and rotors are at the tip
  return limb.damping_Ns_per_m / (2 * (limb.mass_kg + kDevice_kg));
}

double Unsteadiness::Wave::at(double t_s) const noexcept {
  return amplitude * std::sin(radps * t_s + phase_rad);
}

Unsteadiness::Unsteadiness(const Person& person, const LimbImpedance& limb, std::uint64_t seed)
    : person_(person),
      random_(stream_seed(seed, Stream::kUnsteadiness)),
      steady_below_1ps_(sim::steady_below_1ps(limb)) {
  // Tremor: a narrow band about its frequency; each wave as large as a free limb needs it to shake by its share.
  for (auto& direction : tremor_) {
    for (Wave& wave : direction) {
      const double tremor_Hz = person.tremor_Hz + kTremorBand_Hz * (2 * unit_interval(random_) - 1);
      const double share_m = person.tremor_m * std::sqrt(2.0 / kTremorWaves);
      wave = {force_of_tremor_N(limb, share_m, tremor_Hz), kWholeTurn * tremor_Hz, kWholeTurn * unit_interval(random_)};
    }
  }
  for (auto& joint : drift_) {
    for (Wave& wave : joint) {
      wave.radps = kWholeTurn / (kShortestWave_s + (kLongestWave_s - kShortestWave_s) * unit_interval(random_));
      wave.amplitude = person.drift_radps / kDriftWaves / wave.radps;
      wave.phase_rad = kWholeTurn * unit_interval(random_);
    }
  }
  if (person.slips_per_s > 0) slip_until_ = Time{};
}

void Unsteadiness::step(Time now) noexcept {
  const double t = to_seconds(now);
  if (person_.tremor_m > 0) {
    for (std::size_t axis = 0; axis < tremor_.size(); ++axis) {
      double sum = 0;
      for (const Wave& wave : tremor_[axis]) sum += wave.at(t);
      push_N_[static_cast<Eigen::Index>(axis)] = sum;
    }
  }
  if (person_.drift_radps > 0) {
    for (std::size_t i = 0; i < kJoints; ++i) {
      double sum = 0;
      for (const Wave& wave : drift_[i]) sum += wave.at(t) - wave.at(0);
      drift_rad_[static_cast<Eigen::Index>(i)] = sum;
    }
  }
  if (slip_until_ == Time::max()) return;
  if (now >= slip_until_) {  // the next one
    slip_from_ = now + from_seconds(-std::log(1 - unit_interval(random_)) / person_.slips_per_s);
    const double longer = (person_.longest_slip_s - person_.shortest_slip_s) * unit_interval(random_);
    slip_until_ = slip_from_ + from_seconds(person_.shortest_slip_s + longer);
  }
  grip_ = now >= slip_from_ ? person_.slipping_grip : 1;
}

}  // namespace knuckle::sim
