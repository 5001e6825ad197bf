#include "app/console/widgets/units.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace knuckle::console::widgets {
namespace {

struct Entry {
  const char* unit;
  double per_si;
  int digits;  ///< Behind the point.
};

struct Row {
  Entry metric, imperial;
};

// In the order of Quantity. NIST SP 811 gives the factors.
constexpr std::array<Row, 9> kRows{{
    {{"N", 1, 0}, {"lbf", 1 / 4.4482216152605, 0}},
    {{"N", 1, 2}, {"lbf", 1 / 4.4482216152605, 3}},
    {{"m", 1, 2}, {"ft", 1 / 0.3048, 2}},
    {{"mm", 1e3, 0}, {"in", 1 / 0.0254, 2}},
    {{"mm/s", 1e3, 0}, {"in/s", 1 / 0.0254, 1}},
    {{"bar", 1e-5, 0}, {"psi", 1 / 6894.757293168, 0}},
    {{"kg", 1, 1}, {"lb", 1 / 0.45359237, 1}},
    {{"L/min", 6e4, 1}, {"gpm", 60 / 3.785411784e-3, 1}},
    {{"kW", 1e-3, 1}, {"hp", 1 / 745.69987158227, 1}},
}};

const Entry& entry(UnitSystem system, Quantity quantity) noexcept {
  const Row& row = kRows[static_cast<std::size_t>(quantity)];
  return system == UnitSystem::kMetric ? row.metric : row.imperial;
}

}  // namespace

double Units::convert(Quantity quantity, double si) const noexcept {
  return si * entry(system, quantity).per_si;
}

const char* Units::unit(Quantity quantity) const noexcept {
  return entry(system, quantity).unit;
}

Shown Units::number(Quantity quantity, double si) const noexcept {
  if (!std::isfinite(si)) return shown("-");
  const Entry& e = entry(system, quantity);
  const double half_digit = 0.5 * std::pow(10.0, -e.digits);
  const double value = si * e.per_si;
  return shown("%.*f", e.digits, std::abs(value) < half_digit ? 0.0 : value);  // never "-0"
}

Shown Units::text(Quantity quantity, double si) const noexcept {
  return shown("%s %s", number(quantity, si).c_str(), unit(quantity));
}

Shown shown(const char* format, ...) noexcept {
  Shown result;
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(result.text.data(), result.text.size(), format, arguments);
  va_end(arguments);
  return result;
}

Shown fixed(double value, int digits) noexcept {
  return std::isnan(value) ? shown("-") : shown("%.*f", digits, value);
}

Shown shown_duration(double seconds) noexcept {
  if (!std::isfinite(seconds)) return shown("-");
  const double size = std::abs(seconds);
  if (size < 0.9995e-3) return shown("%.0f \xC2\xB5s", seconds * 1e6);
  if (size < 9.95e-3) return shown("%.2f ms", seconds * 1e3);
  if (size < 99.95e-3) return shown("%.1f ms", seconds * 1e3);
  if (size < 0.9995) return shown("%.0f ms", seconds * 1e3);
  if (size < 99.95) return shown("%.1f s", seconds);
  return shown("%.0f s", seconds);
}

}  // namespace knuckle::console::widgets
