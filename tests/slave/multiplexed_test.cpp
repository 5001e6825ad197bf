// Several frames under one identifier: each value from its own, the counter over all of them, one sender.
#include <gtest/gtest.h>

#include <numbers>
#include <optional>

#include "machine/reason_text.h"
#include "slave/bus_map.h"
#include "slave/j1939_bus.h"
#include "slave/sensors.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/multiplexed_machine.h"

namespace knuckle::slave {
namespace {

constexpr std::uint32_t kBoth = 0x18FF1021U | kExtendedId, kBody = 0x1A5;

/// Angles and pressures in turn, every 5 ms a frame; 52 bar in each chamber.
struct FedInTurn {
  void feed(int times = 1) {
    for (int n = 0; n < times; ++n) {
      for (const bool angles : {true, false}) {
        now += 5ms;
        if (angles ? !with_angles : !with_pressures) continue;
        CanFrame frame{kBoth, 8, {76, 76, 76, 76, 76, 76, 0, 2}};
        if (angles) frame.data = {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18, 0, 1};
        if (counts) count = (count + 1) % 16;
        frame.data[6] = static_cast<std::uint8_t>(angles ? angles_count.value_or(count) : count);
        sensors.receive(frame, now);
      }
      CanFrame body{kBody, 4, {0, 0, static_cast<std::uint8_t>(++body_count % 15)}};
      close_frame(machine.bus.broadcasts.at(2).closing, body_count % 15, body);
      sensors.receive(body, now);
    }
  }
  [[nodiscard]] std::string fault() const {
    const Reason why = sensors.fault(now);
    return why ? text_with_code(why, machine.bus) : "";
  }
  MachineDescription machine = calibrated(test::multiplexed_machine());
  SensorSet sensors{machine};
  Time now{1s};
  std::uint64_t body_count = 0;
  unsigned count = 0;
  std::optional<unsigned> angles_count{};  // stands
  bool counts = true, with_angles = true, with_pressures = true;
};

TEST(Multiplexed, EachValueIsReadFromItsOwnFramesAlone) {
  FedInTurn fed;
  fed.feed(50);
  EXPECT_EQ(fed.fault(), "");
  const auto measured = fed.sensors.measurement();
  ASSERT_TRUE(measured);
  EXPECT_NEAR(measured->cylinder_m[kBoom], Kinematics(fed.machine).cylinder_at(kBoom, 0.32)->length_m, 1e-9);
  for (const double pressure_Pa : measured->pressure_Pa) EXPECT_NEAR(pressure_Pa, 5.2e6, 1);
}

TEST(Multiplexed, OneThatNoLongerComesIsTold) {
  FedInTurn fed;
  fed.feed(10);
  fed.with_pressures = false;
  fed.feed(6);
  EXPECT_EQ(fed.fault().rfind("sensor_stale: pressure_1 (0x18FF1021), boom_head_pressure: ", 0), 0U) << fed.fault();
}

TEST(Multiplexed, TheCounterRunsOverAllFramesOfTheIdentifier) {
  FedInTurn fed;
  fed.feed(20);
  EXPECT_EQ(fed.fault(), "");
  fed.counts = false;
  fed.feed(4);
  EXPECT_EQ(fed.fault().rfind("sensor_invalid: ", 0), 0U) << fed.fault();
}

TEST(Multiplexed, OneCountForEachOfTheFramesIsNoneThatStands) {
  BusDescription bus = test::multiplexed_machine().bus;
  for (BroadcastFrame& frame : bus.broadcasts)
    if (frame.multiplexer) frame.closing.counter->modulus = 2;
  ClosedFrames frames(bus);
  for (std::uint8_t n = 0; n < 40; ++n) {
    const auto count = static_cast<std::uint8_t>(n % 2), value = static_cast<std::uint8_t>(1 + n % 2);
    EXPECT_EQ(frames.fault({kBoth, 8, {0, 0, 0, 0, 0, 0, count, value}}), FrameFault::kNone) << int{n};
  }
}

TEST(Multiplexed, OneThatComesAgainAndAgainAmongLivingOnesIsFound) {
  FedInTurn fed;
  fed.feed(20);
  ASSERT_EQ(fed.fault(), "");
  fed.angles_count = fed.count;
  fed.feed(8);
  EXPECT_EQ(fed.fault().rfind("sensor_invalid: pressure", 0), std::string::npos) << fed.fault();
  EXPECT_NE(fed.fault().find("_angle"), std::string::npos) << fed.fault();
}

TEST(Multiplexed, IsOneStreamOnTheBus) {
  const BusDescription bus = test::multiplexed_machine().bus;
  const std::vector<CanFilter> heard = heard_by_controller(bus);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), CanFilter(kBoth)), 1);
  double rate_Hz = 0;
  int streams = 0;
  for (const PeriodicFrame& frame : bus_map(bus)) {
    if (frame.id != kBoth) continue;
    rate_Hz += frame.rate_Hz;
    ++streams;
  }
  EXPECT_EQ(streams, 1);
  EXPECT_NEAR(rate_Hz, 200, 1e-9);
}

TEST(Multiplexed, AGroupHasOneSenderWhateverItsMultiplexerSays) {
  std::string text = test::multiplexed(test::kBroadcasts);
  for (int n = 0; n < 2; ++n) text = test::replaced(text, "id = 0x18FF1021", "pgn = 0xFF10");
  const BusDescription bus = parse_machine(test::broadcast_text(text), "m.toml").bus;
  J1939Bus groups(bus);
  Time now{1s};
  for (const std::uint8_t value : {std::uint8_t{1}, std::uint8_t{2}}) {
    CanFrame from_21{0x18FF1021U | kExtendedId, 8, {0, 0, 0, 0, 0, 0, 0, value}};
    EXPECT_TRUE(groups.receive(from_21, now));
    EXPECT_EQ(from_21.id, bus.broadcasts[0].id);
  }
  EXPECT_FALSE(groups.fault(now));
  CanFrame from_22{0x18FF1022U | kExtendedId, 8, {0, 0, 0, 0, 0, 0, 0, 2}};
  EXPECT_FALSE(groups.receive(from_22, now)) << "its values are none";
  EXPECT_EQ(groups.fault(now).code, ReasonCode::kGroupTwice);
}

TEST(Multiplexed, AMachineOfThemIsLed) {
  test::BenchMachine m(calibrated(test::multiplexed_machine()));
  m.signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
  ASSERT_TRUE(m.engage()) << text(m.loop.fault(), m.loop.client().bus());
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault(), m.loop.client().bus());
  const auto measured = m.loop.sensors().measurement().value();
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(measured.cylinder_m[i], m.signals.cylinder_m[i], 3e-4) << i;
}

}  // namespace
}  // namespace knuckle::slave
