#include "app/console/widgets/units.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace knuckle::console {
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
constexpr std::array<Row, 10> kRows{{
    {{"N", 1, 0}, {"lbf", 1 / 4.4482216152605, 0}},
    {{"N", 1, 2}, {"lbf", 1 / 4.4482216152605, 3}},
    {{"m", 1, 2}, {"ft", 1 / 0.3048, 2}},
    {{"mm", 1e3, 0}, {"in", 1 / 0.0254, 2}},
    {{"mm/s", 1e3, 0}, {"in/s", 1 / 0.0254, 1}},
    {{"bar", 1e-5, 0}, {"psi", 1 / 6894.757293168, 0}},
    {{"kg", 1, 1}, {"lb", 1 / 0.45359237, 1}},
    {{"L/min", 6e4, 1}, {"gpm", 60 / 3.785411784e-3, 1}},
    {{"kW", 1e-3, 1}, {"hp", 1 / 745.69987158227, 1}},
    {{"J", 1, 3}, {"ft lbf", 1 / 1.3558179483314, 3}},
}};

/// Units that texts use.
struct Word {
  std::string_view metric;
  double factor;
  const char* imperial;
};
constexpr auto kWords = std::to_array<Word>({{"N", 1 / 4.4482216152605, "lbf"},
                                             {"kN", 1e3 / 4.4482216152605, "lbf"},
                                             {"kN/m", 1e3 / 175.12683524648, "lbf/in"},
                                             {"m", 1 / 0.3048, "ft"},
                                             {"cm", 1 / 2.54, "in"},
                                             {"mm", 1 / 25.4, "in"},
                                             {"m/s", 1 / 0.3048, "ft/s"},
                                             {"mm/s", 1 / 25.4, "in/s"},
                                             {"bar", 1e5 / 6894.757293168, "psi"},
                                             {"kg", 1 / 0.45359237, "lb"},
                                             {"L/min", 1 / 3.785411784, "gpm"},
                                             {"kW", 1e3 / 745.69987158227, "hp"},
                                             {"J", 1 / 1.3558179483314, "ft lbf"}});

bool in_unit(char c) noexcept {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '*';
}

/// Three digits, or as many as the whole part has, or as were said.
std::string rounded(double value, int said) {
  const double size = std::abs(value);
  const int digits = size >= 99.95 ? 0 : size >= 9.995 ? 1 : size >= 0.9995 ? 2 : 3;
  const int behind = size > 0 ? said - 1 - static_cast<int>(std::floor(std::log10(size))) : 0;
  return fmt::format("{:.{}f}", value, std::clamp(behind, digits, 9));
}

/// A number in a text.
struct Said {
  double value;
  int digits;  ///< Significant ones.
  const char* end;
};
std::optional<Said> number_at(const char* at, const char* end) {
  double value = 0;
  const auto read = std::from_chars(at, end, value);
  if (read.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
  int digits = 0;
  for (const char* c = at; c < read.ptr && *c != 'e' && *c != 'E'; ++c)
    if (std::isdigit(static_cast<unsigned char>(*c)) != 0 && (digits > 0 || *c != '0')) ++digits;
  return Said{value, digits, read.ptr};
}
/// The second number of "0.7 to 1.1 m", which have one unit.
std::optional<Said> range_end(const char* at, const char* end) {
  constexpr std::string_view kTo = " to ";
  if (!std::string_view(at, static_cast<std::size_t>(end - at)).starts_with(kTo)) return std::nullopt;
  return number_at(at + kTo.size(), end);
}

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

std::string Units::number(Quantity quantity, double si) const {
  if (!std::isfinite(si)) return "-";
  const Entry& e = entry(system, quantity);
  const double half_digit = 0.5 * std::pow(10.0, -e.digits);
  const double value = si * e.per_si;
  return fixed(std::abs(value) < half_digit ? 0.0 : value, e.digits);  // never "-0"
}

std::string Units::text(Quantity quantity, double si) const {
  return number(quantity, si) + " " + unit(quantity);
}

std::string Units::as_shown(const std::string& metric) const {
  if (system == UnitSystem::kMetric) return metric;
  std::string text;
  const char* at = metric.c_str();
  const char* const end = at + metric.size();
  while (at < end) {
    const bool begins = at == metric.c_str() || (!in_unit(at[-1]) && at[-1] != '.' && at[-1] != '_');
    const std::optional<Said> number = begins ? number_at(at, end) : std::nullopt;
    if (!number) {
      text += *at++;
      continue;
    }
    const std::optional<Said> to = range_end(number->end, end);
    const char* unit = to ? to->end : number->end;
    if (unit < end && *unit == ' ') ++unit;
    const char* after = unit;
    while (after < end && in_unit(*after)) ++after;
    const std::string_view named(unit, static_cast<std::size_t>(after - unit));
    const auto* word = std::find_if(kWords.begin(), kWords.end(), [&](const Word& w) { return w.metric == named; });
    if (word == kWords.end()) {
      text.append(at, number->end);
      at = number->end;
      continue;
    }
    text += rounded(number->value * word->factor, number->digits) + " ";
    if (to) text += "to " + rounded(to->value * word->factor, to->digits) + " ";
    text += word->imperial;
    at = after;
  }
  return text;
}

std::string fixed(double value, int digits) {
  return std::isnan(value) ? "-" : fmt::format("{:.{}f}", value, digits);
}

double round_above(double value) noexcept {
  const double decade = std::pow(10, std::floor(std::log10(value)));
  for (const double times : {1.0, 2.0, 5.0})
    if (times * decade >= value) return times * decade;
  return 10 * decade;
}

std::string shown_duration(double seconds) {
  if (!std::isfinite(seconds)) return "-";
  const double size = std::abs(seconds);
  if (size < 0.9995e-3) return fmt::format("{:.0f} \xC2\xB5s", seconds * 1e6);
  if (size < 0.9995) return fmt::format("{:.{}f} ms", seconds * 1e3, size < 9.95e-3 ? 2 : size < 99.95e-3 ? 1 : 0);
  return fmt::format("{:.{}f} s", seconds, size < 99.95 ? 1 : 0);
}

}  // namespace knuckle::console
