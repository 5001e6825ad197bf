// `knuckle bus import`: what a person says to be taken of a DBC, and what a DBC does not say. Messages and signals are
// called as the DBC calls them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "machine/bus_description.h"

namespace knuckle::eds {

/// As it is given on the command line.
struct ImportOptions {
  std::vector<std::string> signals{}, commands{}, constants{}, counters{}, checksums{}, periods{};
  std::string bus{};
};

/// Of one signal, or of all of a message that nothing else is said of.
struct PlaceInDbc {
  std::string message, signal;  ///< No signal: all others.
  /// "MESSAGE.SIGNAL", "MESSAGE"
  [[nodiscard]] std::string text() const { return message + (signal.empty() ? "" : "." + signal); }
  bool operator==(const PlaceInDbc&) const = default;
};
/// --signal boom_angle=MESSAGE.SIGNAL; of a pilot pressure boom_extend_pilot=MESSAGE.SIGNAL:shut=0.6,full=2.8
struct WantedSignal {
  PlaceInDbc place;
  const SignalInfo* info = nullptr;      ///< What machine files call it.
  std::optional<double> shut{}, full{};  ///< In the signal's unit; both or none.
};
/// --command boom=MESSAGE.SIGNAL:extend=0.4,retract=-0.4
struct WantedCommand {
  PlaceInDbc place;
  std::string joint;
  std::optional<double> extend{}, retract{};  ///< In the signal's unit.
};
/// --constant MESSAGE.SIGNAL=NEUTRAL or =NEUTRAL,LED; MESSAGE=NEUTRAL
struct WantedConstant {
  PlaceInDbc place;
  double neutral = 0;
  std::optional<double> led{};
};
/// What closes a frame: --counter MESSAGE.SIGNAL or MESSAGE.SIGNAL=MODULUS; --checksum MESSAGE.SIGNAL=crc8-j1850
struct WantedClosing {
  PlaceInDbc place;
  std::optional<std::uint64_t> modulus{};  ///< Of a counter. Else as the file has it, or all that its bits can count.
  std::string kind{};                      ///< Of a checksum, as machine files call it; empty of a counter.
  /// Of the machine file; with two dashes the option's name.
  [[nodiscard]] std::string key() const { return kind.empty() ? "counter" : "checksum"; }
};
/// How often a message comes: --period MESSAGE=20
struct WantedPeriod {
  std::string message;
  double period_ms = 0;
};
/// On which bus: --bus machine, or --bus machine=250 for one that the file does not have yet.
struct WantedBus {
  std::string name;
  std::optional<int> bit_rate_kbps{};
};

struct Wanted {
  std::vector<WantedSignal> signals;
  std::vector<WantedCommand> commands;
  std::vector<WantedConstant> constants;
  std::vector<WantedClosing> closings;  ///< Counters first.
  std::vector<WantedPeriod> periods;
  std::optional<WantedBus> bus;
};
/// @throws InputError where one is not of the form above, or is said twice, where a joint is of two messages (of two,
/// one would be lost), and where nothing is to be taken.
[[nodiscard]] Wanted wanted_of(const ImportOptions& options);

}  // namespace knuckle::eds
