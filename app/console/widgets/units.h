// The one place where SI turns into what a person reads.
#pragma once

#include <cstdint>
#include <string>

namespace knuckle::console {

enum class UnitSystem : std::uint8_t { kMetric, kImperial };

enum class Quantity : std::uint8_t {
  kForce,        ///< N; lbf
  kHandForce,    ///< N with two digits behind the point; lbf
  kLength,       ///< m; ft
  kSmallLength,  ///< m in, mm or in out
  kSpeed,        ///< m/s in, mm/s or in/s out
  kPressure,     ///< Pa in, bar or psi out
  kMass,         ///< kg; lb
  kFlow,         ///< m3/s in, L/min or gpm out
  kPower,        ///< W in, kW or hp out
  kEnergy,       ///< J; ft lbf
};

struct Units {
  UnitSystem system = UnitSystem::kMetric;

  /// The number alone, in the unit shown.
  [[nodiscard]] double convert(Quantity quantity, double si) const noexcept;
  [[nodiscard]] const char* unit(Quantity quantity) const noexcept;
  /// "1234", with the digits that are of use; a dash where it is no number.
  [[nodiscard]] std::string number(Quantity quantity, double si) const;
  /// "1234 N"
  [[nodiscard]] std::string text(Quantity quantity, double si) const;
  /// A text of the loops, the machine's side or a wizard, which all speak metric: each number with a unit in it in the
  /// units shown, with as many digits as are of use.
  [[nodiscard]] std::string as_shown(const std::string& metric) const;
};

/// So many digits behind the point; a dash where it is no number.
[[nodiscard]] std::string fixed(double value, int digits);
/// The next of 1, 2, 5, 10, ...
[[nodiscard]] double round_above(double value) noexcept;
/// A duration with the unit that fits: "0.4 ms", "1.2 s", "12 us".
[[nodiscard]] std::string shown_duration(double seconds);

}  // namespace knuckle::console
