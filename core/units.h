// Units of files, wires and screens, in SI: a number in one of them times its unit is SI. And the number for no value.
#pragma once

#include <limits>
#include <numbers>

namespace knuckle {

inline constexpr double kDegree = std::numbers::pi / 180;                     ///< rad
inline constexpr double kBar = 1e5;                                           ///< Pa
inline constexpr double kMilli = 1e-3;                                        ///< mm, ms, mNm: of their unit
inline constexpr double kLitrePerMinute = 1e-3 / 60;                          ///< m^3/s
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();  ///< Where a table has no value.

}  // namespace knuckle
