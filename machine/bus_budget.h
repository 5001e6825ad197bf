// How full the machine's bus may be, and which changes of its file would make it less full.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "machine/description.h"
#include "transport/can_load.h"

namespace knuckle {

inline constexpr double kFullestBus = 0.6;  ///< Share of the bit rate, with worst-case stuffing.
/// Loads are sums: one at the bound is within it however they were added up.
[[nodiscard]] constexpr bool is_within_fullest(double load) noexcept {
  return load <= kFullestBus * (1 + 1e-9);
}
inline constexpr std::array kBitRates_kbps{10, 20, 50, 125, 250, 500, 800, 1000};  ///< CiA 301, table 1.
/// Without a sensor's value or a valve's command, whatever a file says.
inline constexpr double kLongestBlind_ms = 200;
inline constexpr double kSlowestJoint_s = 0.02;  ///< From one command that moves a joint to the next.
inline constexpr double kOverRange = 1.1;        ///< A pressure is told to be too high, not the highest there is.

/// Every frame of operation with its rate: SYNC, bus_frames(), all heartbeats, what the machine sends by itself, and
/// what it is told by. EMCY and SDO come and go.
[[nodiscard]] std::vector<PeriodicFrame> bus_map(const BusDescription& bus);

/// Load of the machine bus by these in [0, 1], with the worst bit stuffing. @param bus of two one alone
[[nodiscard]] double worst_bus_load(const BusDescription& bus);

/// Of each of two buses; of one the first alone.
[[nodiscard]] std::array<double, 2> worst_bus_loads(const BusDescription& bus);

/// Each by itself brings the bus within kFullestBus: "sync_Hz = 100 with sensor_age_limit_ms = 40 (48 %)". By
/// worst_bus_load() of the changed bus.
/// @param others_bits_per_s what devices send that the file does not have
[[nodiscard]] std::string what_fits(const BusDescription& bus, const SensorDescription& sensors,
                                    double others_bits_per_s = 0);

}  // namespace knuckle
