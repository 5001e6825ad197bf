// The command line: what `knuckle simulate` was asked to do, checked before anything runs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace knuckle::app {

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
  bool realtime = false;
  std::string truth;                       ///< Input: the plant's own parameters, instead of drawing them.
  std::string candump, csv, report, json;  ///< Outputs.

  /// FILE of "path:FILE.csv"; empty for a named operator.
  [[nodiscard]] std::string operator_path() const;
};

/// What main() is to do.
struct CommandLine {
  enum class Command { kSimulate, kPrintText } command = Command::kPrintText;
  SimulateOptions simulate;
  std::string text;  ///< Help or version, for kPrintText.
};

/// @param arguments without the program's name.
/// @throws InputError, one line, for anything that cannot be done: unknown options, values out of bounds, combinations
/// that contradict each other, input files that cannot be read. Outputs are checked where they are opened.
[[nodiscard]] CommandLine parse_command_line(const std::vector<std::string>& arguments);

}  // namespace knuckle::app
