// A transmitter that has all six pressures: set up, read, supervised and named as six are.
#include <gtest/gtest.h>

#include "slave/jog.h"
#include "tests/slave/bench_machine.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

constexpr std::uint8_t kTransmitter = 0x20;

MachineDescription machine_with_one_transmitter() {
  MachineDescription machine = test::test_machine();
  NodeDescription all;
  std::erase_if(machine.bus.nodes, [&all](const NodeDescription& node) {
    if (node.role != NodeRole::kPressure) return false;
    const NodeChannel channel{static_cast<std::uint8_t>(all.channels.size() + 1), node.channels[0].signal};
    std::vector<NodeChannel> channels = all.channels;
    channels.push_back(channel);
    if (all.channels.empty()) all = node;
    all.channels = channels;
    return true;
  });
  all.name = "pressures";
  machine.bus.nodes.insert(machine.bus.nodes.begin() + kJoints, all);
  machine.bus.wire.pressure = WireDescription::Pressure::kInteger16;
  machine.bus.wire.pressure_digits = 1;
  return machine;
}

TEST(SeveralChannels, OneTransmitterIsReadAsSixAre) {
  BenchMachine m(machine_with_one_transmitter());
  ASSERT_TRUE(m.engage()) << text(m.loop.client().setup_failure());
  m.wire.clear();
  m.run(1s);
  for (const std::uint32_t id : {0x1A0U, 0x2A0U, 0x3A0U}) {
    const auto frames = m.frames(id);
    ASSERT_EQ(frames.size(), 200U) << std::hex << id;
    EXPECT_EQ(frames.back().size, 6);
  }
  const auto measured = m.loop.sensors().measurement().value();
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(measured.pressure_Pa[i], m.signals.pressure_Pa[i], 2e5) << i;
  EXPECT_FALSE(m.loop.fault()) << text(m.loop.fault());
}

TEST(SeveralChannels, AFaultIsToldOfTheNode) {
  for (const auto& [fault, code] : {std::pair(sim::NodeFault::kInvalid, ReasonCode::kSensorInvalid),
                                    {sim::NodeFault::kSilent, ReasonCode::kSensorStale}}) {
    BenchMachine m(machine_with_one_transmitter());
    ASSERT_TRUE(m.engage());
    ASSERT_TRUE(m.nodes.inject(kTransmitter, fault));
    m.run(100ms);
    EXPECT_EQ(m.loop.fault().code, code) << text(m.loop.fault());
    EXPECT_EQ(m.loop.fault().subject, kTransmitter);
  }
}

TEST(SeveralChannels, EachFrameHasAnAgeAndALengthOfItsOwn) {
  const MachineDescription machine = machine_with_one_transmitter();
  SensorSet sensors(machine);
  Time now{1s};
  const auto send = [&](std::uint32_t id, std::uint8_t size = 6) {
    sensors.receive({.id = id, .size = size, .data = {0xF4, 0x01, 0, 0xE8, 0x03, 0}}, now);
  };
  for (const std::uint32_t id : {0x1A0U, 0x2A0U, 0x3A0U}) send(id);
  for (const std::uint32_t id : {0x1B0U, 0x1B1U, 0x1B2U})
    sensors.receive({.id = id, .size = 6, .data = {0x84, 0x26, 0, 0, 0, 0}}, now);
  sensors.receive({.id = 0x1B8, .size = 2, .data = {}}, now);
  ASSERT_TRUE(sensors.measurement());
  EXPECT_NEAR(sensors.measurement()->pressure_Pa[4], 50e5, 1);
  EXPECT_NEAR(sensors.measurement()->pressure_Pa[5], 100e5, 1);
  now += 10ms;
  send(0x1A0);
  send(0x3A0);
  EXPECT_EQ(sensors.oldest_at(), Time(1s)) << "that of the frame that did not come";
  for (int i = 0; i < 3; ++i) send(0x2A0, 5);
  EXPECT_EQ(sensors.fault(now).code, ReasonCode::kFrameShort);
  EXPECT_EQ(sensors.fault(now).subject, kTransmitter);
  EXPECT_EQ(sensors.fault(now).limit, 6);
}

TEST(SeveralChannels, ANodeIdThatTwoUseIsNoticedAndOneLateFrameOfEachIsNot) {
  const BusDescription bus = machine_with_one_transmitter().bus;
  const auto after = [&bus](int frames_a_sync, int extra) {
    BusWatch watch(bus);
    watch.count_frames(true);
    Time now{1s};
    for (int sync = 0; sync < 100; ++sync, now += 5ms) {
      watch.step(now);
      watch.synced();
      for (int i = 0; i < frames_a_sync; ++i)
        for (const std::uint32_t id : {0x1A0U, 0x2A0U, 0x3A0U}) watch.receive({.id = id, .size = 6, .data = {}}, now);
    }
    for (int i = 0; i < extra; ++i)
      for (const std::uint32_t id : {0x1A0U, 0x2A0U, 0x3A0U}) watch.receive({.id = id, .size = 6, .data = {}}, now);
    return watch.twice();
  };
  EXPECT_EQ(after(2, 0).code, ReasonCode::kNodeIdTwice);
  EXPECT_EQ(after(2, 0).subject, kTransmitter);
  EXPECT_FALSE(after(1, 0));
  EXPECT_FALSE(after(1, 9)) << "half of what is too many, three times at once: one sign";
}

TEST(SeveralChannels, AreReadBeforeAnythingMoves) {
  const MachineDescription machine = machine_with_one_transmitter();
  VirtualCanBus bus(2, machine.bus.bit_rate);
  sim::CanNodes nodes(machine, {}, bus.port(1), 1);
  sim::MachineSignals signals;
  for (std::size_t i = 0; i < 6; ++i) signals.pressure_Pa[i] = 1e6 * static_cast<double>(i + 1);
  Jog jog(machine, bus.port(0));
  jog.start();
  for (Time now{1s}; now < Time(3s); now += 1ms) {
    nodes.step(now, signals);
    bus.advance(now);
    if (now.time_since_epoch() / 1ms % 5 == 0) jog.step(now);
  }
  ASSERT_TRUE(jog.client().operational()) << text(jog.client().setup_failure());
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(jog.sensors().pressure_Pa[i], signals.pressure_Pa[i], 1e4) << i;
  EXPECT_FALSE(jog.sensors().invalid());
  EXPECT_NE(jog.sensors().oldest(), kNever);
}

}  // namespace
}  // namespace knuckle::slave
