// A transmitter that has all six pressures: set up, read, supervised and named as six are.
#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "slave/plausibility.h"
#include "tests/slave/jog_bench.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

constexpr std::uint8_t kTransmitter = 0x20;

std::string signal_name(const Reason& reason) {
  const auto place = signal_of(reason);
  return place ? kSignals.at(*place).name : "none";
}

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
  ASSERT_TRUE(m.engage()) << m.setup_failure();
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

/// Status first, then what nobody asked for, then the value; the second channel without its status.
TEST(SeveralChannels, ADeviceThatLetsNobodyChangeItsMappingIsReadAsItIs) {
  MachineDescription machine = test::test_machine();
  std::erase_if(machine.bus.nodes, [](const NodeDescription& node) {
    return node.role == NodeRole::kPressure && node.channels[0].info().index == 1;
  });
  NodeDescription& node = test::node_in(machine.bus, NodeRole::kPressure);
  node.channels.push_back({2, static_cast<std::uint8_t>(node.channels[0].signal + 1)});
  node.tpdo_maps = {{0x61500108, 0x00020008, 0x91300120}, {0x91300220}};
  BenchMachine m(machine);
  ASSERT_TRUE(m.engage()) << m.setup_failure();
  m.run(200ms);
  const auto measured = m.loop.sensors().measurement().value();
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(measured.pressure_Pa[i], m.signals.pressure_Pa[i], 2e5) << i;
  EXPECT_EQ(m.frames(0x1A0).back().size, 6);
  EXPECT_EQ(m.frames(0x2A0).back().size, 4);
  m.nodes.inject(kTransmitter, sim::NodeFault::kInvalid);
  m.run(100ms);
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kSensorInvalid, kTransmitter)) << "all its channels";

  MachineDescription usual = machine;
  test::node_in(usual.bus, NodeRole::kPressure).tpdo_maps.clear();
  JogBench other(usual, machine);
  other.begin();
  EXPECT_TRUE(test::says(text(other.jog.client().setup_failure(), machine.bus),
                         "0x1A00:00 gave 0x2, the machine file says 0x3"));
}

TEST(SeveralChannels, AFrameThatIsMissingNamesItsFirstSignalInTheFaultThatTheOperatorReads) {
  BenchMachine m(machine_with_one_transmitter());
  ASSERT_TRUE(m.engage());
  m.can.lost = {m.description.bus.pressure(0).tpdo_id(1)};
  m.run(100ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(text(m.link.last()->fault, m.description.bus),
                           "pressures (node 0x20), arm_head_pressure: sensor has stopped sending"));
  m.can.lost.clear();
  m.run(1s);
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

TEST(SeveralChannels, AStaleSignalsFaultBecomesThatOfItsNodeOnceTheNodeSaysThatItStopped) {
  const BusDescription bus = machine_with_one_transmitter().bus;
  const Reason stale{ReasonCode::kSensorStale, subject_of(NodeRole::kPressure, 2, bus), 31, 25};
  ASSERT_TRUE(signal_of(stale));
  EXPECT_TRUE(explains({ReasonCode::kNodeFault, kTransmitter, 0, 5}, stale, bus));
  EXPECT_FALSE(explains({ReasonCode::kNodeFault, 0x30, 0, 5}, stale, bus));
  EXPECT_FALSE(explains({ReasonCode::kNodeSilent, kTransmitter, 0, 5}, stale, bus));
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
  EXPECT_EQ(sensors.oldest_node(), kTransmitter);
  EXPECT_EQ(sensors.oldest_subject(), kTransmitter) << "not yet longer than frames are apart";
  for (int i = 0; i < 3; ++i) send(0x2A0, 5);
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kFrameShort));
  EXPECT_EQ(signal_name(sensors.fault(now)), "arm_head_pressure");
  EXPECT_EQ(sensors.fault(now).limit, 6);
  for (int i = 0; i < 3; ++i) {
    send(0x1A0, 5);
    send(0x3A0, 5);
  }
  EXPECT_TRUE(test::is(sensors.fault(now), ReasonCode::kFrameShort, kTransmitter)) << "all of them";
}

TEST(SeveralChannels, AnImpossibleValueNamesItsSignal) {
  const MachineDescription machine = machine_with_one_transmitter();
  SensorSet sensors(machine);
  const CanFrame second_broken{.id = 0x3A0, .size = 6, .data = {0xF4, 0x01, 0, 0xE8, 0x03, canopen::kPressureInvalid}};
  for (int i = 0; i < 3; ++i) sensors.receive(second_broken, Time(1s));
  EXPECT_TRUE(test::is(sensors.fault(Time(1s)), ReasonCode::kSensorInvalid));
  EXPECT_EQ(signal_name(sensors.fault(Time(1s))), "bucket_rod_pressure");
}

TEST(SeveralChannels, APressureThatContradictsTheOthersIsNamed) {
  const MachineDescription machine = machine_with_one_transmitter();
  Plausibility rules(machine, 0.005);
  estimation::Measurement m;
  m.pressure_Pa.fill(50e5);
  m.cylinder_m = JointVector(1, 1, 1);
  Reason found;
  for (int i = 0; i < 200 && !found; ++i) {
    m.pressure_Pa[2] += 1e5;  // of the arm only the rod side stands
    found = rules.step(m, JointVector::Zero(), {});
  }
  EXPECT_TRUE(test::is(found, ReasonCode::kSensorImplausible));
  EXPECT_EQ(signal_name(found), "arm_rod_pressure");
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
  EXPECT_TRUE(test::is(after(2, 0), ReasonCode::kNodeIdTwice, kTransmitter));
  EXPECT_FALSE(after(1, 0));
  EXPECT_FALSE(after(1, 9)) << "half of what is too many, three times at once: one sign";
}

}  // namespace
}  // namespace knuckle::slave
