// The one place where SI turns into what a person reads.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace knuckle::console::widgets {

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

/// Text in place: screens make a hundred of them each frame and nothing is allocated.
struct Shown {
  std::array<char, 32> text{};
  [[nodiscard]] const char* c_str() const noexcept { return text.data(); }
};

struct Units {
  UnitSystem system = UnitSystem::kMetric;

  /// The number alone, in the unit shown.
  [[nodiscard]] double convert(Quantity quantity, double si) const noexcept;
  [[nodiscard]] const char* unit(Quantity quantity) const noexcept;
  /// "1234", with the digits that are of use; a dash where it is no number.
  [[nodiscard]] Shown number(Quantity quantity, double si) const noexcept;
  /// "1234 N"
  [[nodiscard]] Shown text(Quantity quantity, double si) const noexcept;
  /// A text of the loops, the machine's side or a wizard, which all speak metric: each number with a unit in it in the
  /// units shown, with as many digits as are of use.
  [[nodiscard]] std::string as_shown(const std::string& metric) const;
};

/// printf into a Shown; longer text is cut.
[[nodiscard]] [[gnu::format(printf, 1, 2)]] Shown shown(const char* format, ...) noexcept;
/// So many digits behind the point; a dash where it is no number.
[[nodiscard]] Shown fixed(double value, int digits) noexcept;
/// A duration with the unit that fits: "0.4 ms", "1.2 s", "12 us".
[[nodiscard]] Shown shown_duration(double seconds) noexcept;

}  // namespace knuckle::console::widgets
