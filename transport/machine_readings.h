// What a machine tells people of itself beside what it is led by: engine, temperatures, hours, battery. A datagram of
// its own on the link, once a second; who does not know it drops it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/units.h"
#include "transport/link.h"
#include "transport/link_header.h"

namespace knuckle {

/// SI but for temperatures; kUnknown where the machine does not say it, or says that it is not available.
struct MachineReadings {
  static constexpr const char* kSchemaName = "MachineReadings";
  static constexpr std::size_t kCount = 7;

  double engine_speed_radps = kUnknown;
  double engine_running = kUnknown;  ///< 1: yes, 0: no.
  double oil_temperature_degC = kUnknown, coolant_temperature_degC = kUnknown;
  double engine_time_s = kUnknown;
  double battery_V = kUnknown;
  double fuel_level = kUnknown;  ///< Of the tank, [0, 1].

  /// In the order of kSignals (machine/bus_description.h).
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [engine_speed_radps, engine_running, oil_temperature_degC, coolant_temperature_degC,
                                  engine_time_s, battery_V, fuel_level] = s;
    visit("engine_speed_radps", s.engine_speed_radps);
    visit("engine_running", s.engine_running);
    visit("oil_temperature_degC", s.oil_temperature_degC);
    visit("coolant_temperature_degC", s.coolant_temperature_degC);
    visit("engine_time_s", s.engine_time_s);
    visit("battery_V", s.battery_V);
    visit("fuel_level", s.fuel_level);
  }
};

/// Machine to operator.
struct ReadingsMessage {
  LinkStamp stamp;
  std::uint8_t known = 0;  ///< Bit i: the i-th reading is known.
  std::array<double, MachineReadings::kCount> values{};

  void set(const MachineReadings& readings) noexcept;
  [[nodiscard]] MachineReadings readings() const noexcept;

  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [stamp, known, values] = s;
    visit("stamp", s.stamp);
    visit("known", s.known);
    visit("values", s.values, wire::cut(1e12));
  }
};

[[nodiscard]] Datagram encode(const ReadingsMessage& message) noexcept;
/// nullopt where size, magic or version is wrong, or a field not acceptable (link_header.h).
[[nodiscard]] std::optional<ReadingsMessage> decode_readings(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace knuckle
