// One seed for everything that is sampled, and yet nothing sampled alike twice: each purpose has a stream of its own.
#pragma once

#include <cstdint>
#include <random>

namespace knuckle {

/// What numbers are sampled for. A new purpose goes to the end.
enum class Stream : std::uint64_t {
  kDay = 1,
  kSensorNoise,
  kSurvey,
  kLoads,
  kWarmUp,
  kSlow,
  kDigging,
  kExcitation,
  kValidation,
  kUse,
  kFine,
  kPerson,
  kUnsteadiness,
  kServiced,
  kWorn,
  kDevice,
  kSurveyFrame,
  kCell,
  kWander
};

/// Seed of one purpose; neighbouring seeds have nothing in common (finaliser of SplitMix64, Steele et al. 2014).
[[nodiscard]] constexpr std::uint64_t stream_seed(std::uint64_t seed, Stream stream) noexcept {
  std::uint64_t z = seed + 0x9E3779B97F4A7C15U * static_cast<std::uint64_t>(stream);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31);
}

/// The next number in [0, 1), the same on every platform, unlike the standard's distributions.
[[nodiscard]] inline double unit_interval(std::mt19937_64& generator) noexcept {
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

}  // namespace knuckle
