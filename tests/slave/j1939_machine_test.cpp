// Machines with J1939 groups, from wire to wire: led by them, told of by them, and stopped by what contradicts them.
#include "tests/support/j1939_machine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "slave/bus_map.h"
#include "slave/status_reporter.h"
#include "tests/slave/leading.h"
#include "tests/support/says.h"
#include "transport/j1939.h"
#include "transport/machine_readings.h"

namespace knuckle::slave {
namespace {

struct J1939Machine : test::BenchMachine {
  using BenchMachine::BenchMachine;
  [[nodiscard]] MachineReadings readings() const { return loop.sensors().readings(now); }
  void send(const CanFrame& frame) { (void)bus.port(2).send(frame); }
};

void expect_readings(const MachineReadings& readings) {
  EXPECT_NEAR(readings.engine_speed_radps, 1800 * 2 * std::numbers::pi / 60, 0.02);
  EXPECT_EQ(readings.engine_running, 1);
  EXPECT_EQ(readings.oil_temperature_degC, 48);
  EXPECT_EQ(readings.coolant_temperature_degC, 84);
  EXPECT_NEAR(readings.engine_time_s, 4321 * 3600, 90);
  EXPECT_NEAR(readings.battery_V, 27.6, 0.03);
  EXPECT_TRUE(std::isnan(readings.fuel_level)) << "in no frame";
}

TEST(J1939Machine, IsLedAndTellsOfItself) {
  for (const bool by_frames : {false, true}) {
    J1939Machine m(by_frames ? test::commanded_j1939_machine()
                             : test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10"));
    ASSERT_TRUE(m.engage()) << m.fault();
    m.run(1500ms);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
    expect_readings(m.readings());
    EXPECT_EQ(m.loop.j1939().news_count(), 0U);
  }
}

TEST(J1939Machine, WhatIsNotAvailableOrNoLongerComesIsUnknownAndStopsNothing) {
  J1939Machine m(test::j1939_machine());
  ASSERT_TRUE(m.engage()) << m.fault();
  m.run(1500ms);
  const std::uint32_t engine = 0x18F00400U | kExtendedId;
  m.can.lost = {engine};
  m.send({.id = 0x0CF00400U | kExtendedId, .size = 8, .data = {0, 0, 0, 0xFF, 0xFF, 0, 0xF0}});
  m.run(10ms);
  EXPECT_TRUE(std::isnan(m.readings().engine_speed_radps)) << "not available";
  EXPECT_EQ(m.readings().engine_running, 1) << "starter mode 0";
  m.run(100ms);
  EXPECT_TRUE(std::isnan(m.readings().engine_running)) << "no longer sent";
  m.can.lost.clear();
  m.run(50ms);
  expect_readings(m.readings());
  m.send({.id = 0x0CF00400U | kExtendedId, .size = 3, .data = {}});
  m.run(5ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
}

TEST(J1939Machine, AnOrderlyStopHearsPilotPressureInAGroup) {
  const std::string state = test::replaced(test::kStateBroadcast, "id = 0x18FF4021", "pgn = 0xFF40");
  J1939Machine m(parse_machine(test::command_text(test::kRateCommands, state), "m.toml"));
  ASSERT_TRUE(m.engage()) << m.fault();
  OrderlyStop stop(m.description, m.can);
  test::take_out_of_service(m, stop);
  EXPECT_FALSE(stop.unconfirmed_pilot());
}

TEST(J1939Machine, ASecondSenderOfItsAnglesStopsIt) {
  J1939Machine m(test::j1939_machine("id = 0x18FF1021", "pgn = 0xFF10"));
  ASSERT_TRUE(m.engage()) << m.fault();
  const auto before = m.loop.sensors().measurement()->cylinder_m;
  m.send({.id = 0x18FF1077U | kExtendedId, .size = 8, .data = {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18}});
  m.run(10ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "group_twice: front_angle (PGN 0xFF10), arm_angle: two devices send"));
  EXPECT_LT((m.loop.sensors().measurement()->cylinder_m - before).norm(), 1e-3) << "and was not believed";
}

TEST(J1939Machine, CommandsWaitForTheirAddressAndEndWithIt) {
  J1939Machine m(test::commanded_j1939_machine());
  m.run(240ms);
  EXPECT_TRUE(m.frames(0x18FF0105U | kExtendedId).empty()) << "not claimed yet";
  ASSERT_TRUE(m.engage()) << m.fault();
  m.send(j1939::claim_frame(1, 0x05));
  m.run(20ms);
  EXPECT_TRUE(m.faulted(ReasonCode::kAddressLost));
  m.wire.clear();
  m.hand.enable = false;
  m.run(3s);
  EXPECT_TRUE(m.frames(0x18FF0105U | kExtendedId).empty()) << "that address is another device's";
  EXPECT_FALSE(m.nodes.outputs().pilot);
}

TEST(J1939Machine, FiltersLetThroughAllThatIsLookedAt) {
  for (const MachineDescription& machine : {test::commanded_j1939_machine(), test::j1939_machine()}) {
    const std::vector<CanFilter> filters = heard_by_controller(machine.bus);
    for (const std::uint32_t id : {0x0CF00400U, 0x18F00417U, 0x18FEEE03U, 0x18EEFF05U, 0x18EAFF21U, 0x18EA0521U})
      EXPECT_TRUE(hears(filters, id | kExtendedId)) << std::hex << id;
    EXPECT_EQ(hears(filters, 0x0CFF0127U | kExtendedId), machine.bus.by_frames());
    EXPECT_FALSE(hears(filters, 0x18F00300U | kExtendedId));
    EXPECT_FALSE(hears(filters, 0x18F00400U));
  }
  EXPECT_FALSE(hears(heard_by_controller(test::broadcast_machine().bus), 0x18EEFF05U | kExtendedId));
}

/// Keeps the newest readings, and counts them.
class ReadingsTold final : public Link {
 public:
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    if (const auto message = decode_readings(bytes)) {
      newest = message->readings();
      ++count;
    }
    return true;
  }
  bool receive(Datagram& /*datagram*/) noexcept override { return false; }
  MachineReadings newest;
  int count = 0;
};

TEST(J1939Machine, TellsTheOperatorOnceASecond) {
  for (const bool has_any : {true, false}) {
    J1939Machine m(has_any ? test::j1939_machine() : test::broadcast_machine());
    CanMeter meter;
    ReadingsTold told;
    StatusReporter reporter(m.description, m.bus.port(0), meter, told, false);
    for (int i = 0; i < 1000; ++i) {
      m.run(5ms);
      reporter.step(m.now, m.loop);
    }
    EXPECT_EQ(told.count, has_any ? 5 : 0);
    if (has_any) expect_readings(told.newest);
  }
}

}  // namespace
}  // namespace knuckle::slave
