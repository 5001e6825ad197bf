// Numbers as people read them.
#pragma once

#include <string>

namespace knuckle::report {

/// So many significant digits, more only before the point, never a power of ten: "3512", "0.0397", "< 0.000001". "-"
/// where it is not finite.
[[nodiscard]] std::string number_text(double value, int significant = 3);

}  // namespace knuckle::report
