// The options of a session, as given on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sim/operator_limb.h"

namespace knuckle::session {

/// Empty strings mean "as the scenario says" for inputs and "not asked for" for outputs; "-" is standard output.
struct SimulateOptions {
  std::string scenario = "dismantle";  ///< Name in config/scenarios or path of a .toml file.
  std::string machine, device;         ///< Likewise in config/machines, config/devices.
  std::string operator_name;           ///< Limb of the operator, or "path:FILE.csv": a recorded motion.
  std::string map;                     ///< Mapping file of a recorded motion.
  std::string control;                 ///< Bilateral law.
  std::optional<double> duration_s;
  std::uint64_t seed = 1;
  std::optional<double> delay_ms, jitter_ms, loss;  ///< Link, one way; loss in [0, 1].
  std::optional<double> assist_force_limit_N;       ///< 0: off.
  bool assist_stop_on_object = false;
  bool realtime = false;
  std::string truth;                       ///< Input: the plant's own parameters, instead of sampling them.
  std::string candump, csv, report, json;  ///< Outputs.

  /// FILE of "path:FILE.csv"; empty for a named operator.
  [[nodiscard]] std::string operator_path() const;
};

/// The operator's limb by its name, as --operator takes it; none given: fallback.
/// @param or_else what else the option takes, for the message. @throws InputError
[[nodiscard]] sim::LimbClass limb_named(const std::string& name, sim::LimbClass fallback,
                                        const std::string& or_else = "");

}  // namespace knuckle::session
