// Units of the values that a machine sends by itself: as its file may have them, and as people read them.
#pragma once

#include <span>
#include <string>

#include "machine/bus_description.h"

namespace knuckle {

struct Unit {
  const char* name;
  double si;
};

[[nodiscard]] constexpr bool is_angle(const SignalInfo& signal) noexcept {
  return signal.is_angle || signal.role == NodeRole::kTilt;
}

/// Those that a machine file may give for a signal; none for one that says yes or no.
[[nodiscard]] std::span<const Unit> units_of(const SignalInfo& signal) noexcept;
/// Of a signal that has one.
[[nodiscard]] const Unit& shown_unit(const SignalInfo& signal) noexcept;
/// "60.2 bar", "1800 rpm", "yes". @param value SI; 1 and 0 for yes and no. Allocates.
[[nodiscard]] std::string value_text(const SignalInfo& signal, double value);

}  // namespace knuckle
