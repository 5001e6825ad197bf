#include "app/report/number_text.h"

#include <fmt/format.h>

#include <cmath>

namespace knuckle::report {

std::string number_text(double value, int significant) {
  constexpr double kSmallest = 1e-6;
  if (!std::isfinite(value)) return "-";
  if (value == 0) return "0";
  if (std::abs(value) < kSmallest) return value > 0 ? "< 0.000001" : "> -0.000001";
  const int decimals = significant - 1 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  if (decimals <= 0) return fmt::format("{:.0f}", value);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  text.resize(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace knuckle::report
