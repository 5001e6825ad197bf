// One drawn session of a battery: a pure function of the settings and its index, so that it can be run anywhere, in
// any order, and again.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "app/battery/settings.h"
#include "app/session/options.h"
#include "core/seed.h"
#include "machine/description.h"
#include "sim/person.h"
#include "sim/truth.h"

namespace knuckle::battery {

struct Cell {
  std::uint64_t index = 0;
  session::SimulateOptions options;  ///< Runs it, with no outputs asked for.
  nlohmann::ordered_json drawn;      ///< What was drawn, by name: the columns that tables group by.
  nlohmann::ordered_json effects;    ///< What the sampled machine is like (effects.h).
};

/// Draws the cells of one battery.
class Drawer {
 public:
  /// @throws InputError where the machine or a scenario is not there.
  explicit Drawer(const Settings& settings);

  /// @param index below Settings::sessions.
  [[nodiscard]] Cell cell(std::uint64_t index) const;

 private:
  Settings settings_;
  MachineDescription machine_;       ///< As drawn.
  double force_scale_;               ///< Hand newtons per machine newton, of its device.
  std::vector<double> most_felt_N_;  ///< That a person is asked to hold, by scenario.
};

// A session of a battery again, from the battery's result.

/// @param name FILE:N: session N of the battery whose result `knuckle-studies sweep --json` wrote into FILE; as
/// --from-cell takes it. @return its inputs, and the digest that it had. @throws InputError
[[nodiscard]] session::SimulateOptions cell_of_result(const std::string& name);

// A press on a wall that nobody tuned to: where it stands and how stiff it is, which part of the bucket meets it, pose,
// speed, force, limb.

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
