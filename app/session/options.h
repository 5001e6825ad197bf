// The options of a session, as given on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/person.h"

namespace knuckle::session {

/// Empty strings mean "as the scenario says" for inputs and "not asked for" for outputs; "-" is standard output.
struct SimulateOptions {
  std::string scenario = "dismantle";  ///< Name in config/scenarios or path of a .toml file.
  std::string from_cell;               ///< "FILE:N": as session N of a battery's result, all inputs but this are its.
  std::string cell_digest;             ///< Of that session when the battery ran it; empty: unknown.
  std::string scenario_text;           ///< TOML of a drawn one, which then has this name; else empty.
  std::string machine, device;         ///< Likewise in config/machines, config/devices.
  std::string operator_name;           ///< Limb of the operator, or "path:FILE.csv": a recorded motion.
  std::string person;                  ///< How much of a person the operator is.
  std::string map;                     ///< Mapping file of a recorded motion.
  std::string control;                 ///< Bilateral law.
  std::string contact_model;           ///< In place of the machine file's.
  std::optional<double> duration_s;
  std::uint64_t seed = 1;
  /// Of the simulated machine, when it is not the session's: it has been sampled by this one, and is used on another
  /// day.
  std::optional<std::uint64_t> machine_seed;
  std::optional<double> delay_ms, jitter_ms, loss;  ///< Link, one way; loss in [0, 1].
  std::optional<double> bursts_per_s;               ///< Outages of 50 ms, each way.
  std::string impairment;                           ///< Link, name in config/links or .toml file, instead of all these.
  std::string listen, connect;                      ///< With realtime: addresses of the link's two ends.
  std::optional<double> assist_force_limit_N;       ///< 0: off.
  bool assist_stop_on_object = false;
  bool realtime = false;
  bool verbose = false;                    ///< The summary also lists what was met.
  bool judge = false;                      ///< Requirements decide, whatever the set-up.
  std::string family;                      ///< Which machines and devices the seed samples from; empty: smooth.
  std::string truth;                       ///< Input: the plant's own parameters, instead of sampling them.
  std::string candump, csv, report, json;  ///< Outputs.
  std::string log, flights;                ///< Recording (.mcap); folder of flight records.

  /// The files of "path:FILE.csv", or of "path:FILE.mcap,FILE.mcap", the parts of a recording in their order; none for
  /// a named operator.
  [[nodiscard]] std::vector<std::string> operator_paths() const;

  bool operator==(const SimulateOptions&) const = default;
};

inline constexpr const char* kDefaultMachine = "solar015";
/// Whether a scenario runs as its requirements were taken: on the default machine, and nothing else changed.
[[nodiscard]] bool is_stock(const SimulateOptions& options);

/// The operator's limb by its name, as --operator takes it; none given: fallback.
/// @param or_else what else the option takes, for the message. @throws InputError
[[nodiscard]] sim::LimbClass limb_named(const std::string& name, sim::LimbClass fallback,
                                        const std::string& or_else = "");

/// Likewise how much of a person the operator is, as --person takes it.
[[nodiscard]] sim::PersonClass person_named(const std::string& name, sim::PersonClass fallback);

}  // namespace knuckle::session
