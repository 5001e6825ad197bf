// What a machine tells people of itself, on the link.
#include "transport/machine_readings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "machine/bus_description.h"

namespace knuckle {
namespace {

TEST(MachineReadings, TravelAndWhatIsUnknownStaysSo) {
  MachineReadings told;
  told.engine_speed_radps = 188.5;
  told.battery_V = 0;
  ReadingsMessage message;
  message.stamp.session = 7;
  message.set(told);
  const auto received = decode_readings(encode(message).view());
  ASSERT_TRUE(received);
  EXPECT_EQ(received->stamp.session, 7U);
  const MachineReadings readings = received->readings();
  EXPECT_EQ(readings.engine_speed_radps, 188.5);
  EXPECT_EQ(readings.battery_V, 0);
  for (const double unknown : {readings.engine_running, readings.oil_temperature_degC,
                               readings.coolant_temperature_degC, readings.engine_time_s, readings.fuel_level})
    EXPECT_TRUE(std::isnan(unknown));
}

TEST(MachineReadings, NothingElseIsTakenForThem) {
  Datagram datagram = encode(ReadingsMessage{});
  EXPECT_FALSE(decode_readings(datagram.view().first(datagram.size - 1U)));
  datagram.bytes[3] = 9;  // kind
  EXPECT_FALSE(decode_readings(datagram.view()));
}

/// Signals of the machine file and fields of the struct are one list: a value must not become its neighbour's.
TEST(MachineReadings, AreInTheOrderOfTheSignals) {
  std::vector<std::string> signals, fields;
  for (const SignalInfo& signal : kSignals) {
    if (signal.role != NodeRole::kReading) continue;
    EXPECT_EQ(signal.index, static_cast<int>(signals.size()));
    signals.emplace_back(signal.name);
  }
  const MachineReadings readings;
  MachineReadings::fields(readings, [&](const char* name, double) { fields.emplace_back(name); });
  EXPECT_EQ(signals,
            (std::vector<std::string>{"engine_speed", "engine_running", "oil_temperature", "coolant_temperature",
                                      "engine_hours", "battery_voltage", "fuel_level"}));
  EXPECT_EQ(fields, (std::vector<std::string>{"engine_speed_radps", "engine_running", "oil_temperature_degC",
                                              "coolant_temperature_degC", "engine_time_s", "battery_V", "fuel_level"}));
  EXPECT_EQ(fields.size(), MachineReadings::kCount);
}

}  // namespace
}  // namespace knuckle
