// One drawn session of a battery: a pure function of the settings and its index, so that it can be run anywhere, in
// any order, and again.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/battery/settings.h"
#include "app/session/options.h"
#include "machine/description.h"

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

}  // namespace knuckle::battery
