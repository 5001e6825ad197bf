// A press on a wall that nobody tuned to: where it stands and how stiff it is, which part of the bucket meets it, pose,
// speed, force, limb.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "app/battery/cell.h"
#include "app/battery/settings.h"
#include "core/seed.h"
#include "machine/description.h"
#include "sim/person.h"
#include "sim/truth.h"

namespace knuckle::battery {

/// Adds scenario and columns to a cell that has its link and machine. No press is asked for that would tip the machine.
/// @param force_scale hand newtons per machine newton.
/// @throws InputError where the machine has no room for any such press.
void draw_press(const MachineDescription& machine, const sim::HullTruth& hull, double force_scale,
                const Settings& settings, std::mt19937_64& random, Cell& cell);

// How values are drawn.

[[nodiscard]] inline double between(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * unit_interval(random);
}
[[nodiscard]] inline double by_ratio(std::mt19937_64& random, const Span& span) {
  return span.low * std::pow(span.high / span.low, unit_interval(random));
}
[[nodiscard]] inline std::size_t pick(std::mt19937_64& random, std::size_t count) {
  return static_cast<std::size_t>(unit_interval(random) * static_cast<double>(count));
}
[[nodiscard]] inline double one_of(std::mt19937_64& random, const std::vector<double>& values) {
  return values[pick(random, values.size())];
}
[[nodiscard]] inline sim::LimbClass draw_limb(std::mt19937_64& random) {
  constexpr std::size_t kLimbs = 4;
  return static_cast<sim::LimbClass>(pick(random, kLimbs));
}

}  // namespace knuckle::battery
