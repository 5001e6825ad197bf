// What the machine file says of identifiers, scalings and patience reaches the nodes; what goes wrong is told in words.
#include "slave/node_setup.h"

#include <gtest/gtest.h>

#include "tests/slave/bench_machine.h"
#include "tests/slave/kept_bus.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

TEST(NodeSetup, FramesCarryTheIdentifiersOfTheMachineFile) {
  MachineDescription d = test::test_machine();
  test::node_in(d.bus, NodeRole::kValve, kArm).tpdos[0] = 0x2A1;
  test::node_in(d.bus, NodeRole::kValve, kArm).rpdos[0] = 0x3A2;
  test::node_in(d.bus, NodeRole::kPressure, 3).tpdos[0] = 0x1F0;
  test::node_in(d.bus, NodeRole::kEncoder, kBoom).tpdos[0] = 0x281;
  test::node_in(d.bus, NodeRole::kTilt).tpdos[0] = 0x4B0;
  test::node_in(d.bus, NodeRole::kEnable).tpdos[0] = 0x2C1;
  test::node_in(d.bus, NodeRole::kEnable).rpdos[0] = 0x3C1;
  BenchMachine m(d);
  ASSERT_TRUE(m.engage()) << text(m.loop.client().fault());
  m.wire.clear();
  m.run(1s);
  EXPECT_EQ(m.frames(0x3A2).size(), 200U);
  EXPECT_EQ(m.frames(0x2A1).size(), 50U);
  EXPECT_EQ(m.frames(0x4B0).size(), 100U);
  for (const std::uint32_t id : {0x1F0U, 0x281U}) EXPECT_EQ(m.frames(id).size(), 200U) << id;
  for (const std::uint32_t id : {0x191U, 0x211U, 0x1A3U, 0x1B0U, 0x1B8U, 0x1C0U, 0x240U}) {
    EXPECT_TRUE(m.frames(id).empty()) << id;
  }
  EXPECT_TRUE(m.loop.client().pilot_on());
  EXPECT_NEAR(m.loop.sensors().measurement()->pressure_Pa[3], m.signals.pressure_Pa[3], 2e5);
}

TEST(NodeSetup, ValuesAreScaledAsTheMachineFileSays) {
  for (const bool is_float : {false, true}) {
    MachineDescription d = test::test_machine();
    d.bus.wire.valve_full_stroke = 1000;
    d.bus.wire.pressure = is_float ? WireDescription::Pressure::kFloat : WireDescription::Pressure::kInteger;
    d.bus.wire.pressure_digits = 1;
    d.bus.wire.encoder_speed_step_mps = 1e-3;
    BenchMachine m(d);
    ASSERT_TRUE(m.engage()) << m.setup_failure();
    m.move(JointVector(0.3, 0, 0), 300ms);
    const CanFrame command = m.frames(0x210).back();
    const auto raw = static_cast<std::int16_t>(command.data[2] | command.data[3] << 8);
    EXPECT_NEAR(raw, 1000 * m.loop.client().demand()[kBoom], 50);  // the newest is on its way
    EXPECT_GT(raw, 100);
    EXPECT_NEAR(m.loop.client().spool()[kBoom], m.signals.spool[kBoom], 0.05);
    EXPECT_GT(m.loop.client().spool()[kBoom], 0.1);
    const CanFrame pressure = m.frames(0x1A0).back();
    const std::uint32_t bits = pressure.data[0] | static_cast<std::uint32_t>(pressure.data[1]) << 8 |
                               static_cast<std::uint32_t>(pressure.data[2]) << 16 |
                               static_cast<std::uint32_t>(pressure.data[3]) << 24;
    const double bar = is_float ? double{std::bit_cast<float>(bits)} : 0.1 * static_cast<std::int32_t>(bits);
    EXPECT_NEAR(bar, m.signals.pressure_Pa[0] / 1e5, 2);
    EXPECT_NEAR(m.loop.sensors().measurement()->pressure_Pa[0], m.signals.pressure_Pa[0], 2e5);
  }
}

TEST(NodeSetup, TheSlopeMayBeATiltSensorsSecondAxis) {
  MachineDescription d = test::test_machine();
  test::node_in(d.bus, NodeRole::kTilt).channels[0].number = 2;
  BenchMachine m(d);
  m.signals.slope_rad = 0.1;
  ASSERT_TRUE(m.starts()) << m.setup_failure();
  m.run(100ms);
  const CanFrame frame = m.frames(0x1B8).back();
  ASSERT_EQ(frame.size, 2);
  EXPECT_EQ(frame.data[0] | frame.data[1] << 8, 57) << "0x6020, in 0.1 deg; 0x6010 stays level";
  EXPECT_NEAR(m.loop.sensors().measurement()->hull_pitch_rad, 0.1, 1e-3);
}

TEST(NodeSetup, PressureThatIsNoNumberIsNotUsed) {
  MachineDescription d = test::test_machine();
  d.bus.wire.pressure = WireDescription::Pressure::kFloat;
  BenchMachine m(d);
  ASSERT_TRUE(m.engage());
  ASSERT_TRUE(m.nodes.inject(0x22, sim::NodeFault::kInvalid));
  m.run(100ms);
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kSensorInvalid, 0x22));
}

TEST(NodeSetup, SilentNodeIsGivenUpAfterTheFilesPatienceAndToldSo) {
  MachineDescription d = test::test_machine();
  d.bus.sdo_timeout_s = 0.06;
  d.bus.boot_timeout_s = 0.3;
  BenchMachine m(d);
  ASSERT_TRUE(m.nodes.inject(0x31, sim::NodeFault::kSilent));
  const Time start = m.now;
  EXPECT_TRUE(test::is(m.fails(), ReasonCode::kNodeSetup));
  EXPECT_NEAR(to_seconds(m.now - start), 0.3 + 2 * 0.06 + 2 * 0.06, 0.05) << "boot, and two answers twice";
  EXPECT_EQ(m.setup_failure(),
            "arm_encoder (node 0x31): reading 0x1000:00 was not answered: check its power, cable and node id");
  m.run(5ms);
  const std::vector<CanFrame> requests = m.frames(0x631);
  ASSERT_GE(requests.size(), 8U);  // asked, abandoned, asked, abandoned, and so on while it may be booting
  const std::array<std::uint8_t, 8> timed_out{0x80, 0x00, 0x10, 0x00, 0x00, 0x00, 0x04, 0x05};
  for (std::size_t i = 1; i < requests.size(); i += 2) EXPECT_EQ(requests[i].data, timed_out);
}

TEST(NodeSetup, FailureNamesTheObjectAndWhatTheNodeSaid) {
  BenchMachine other_device;
  other_device.nodes.set_product(0x10, 0x77);
  EXPECT_TRUE(test::is(other_device.fails(), ReasonCode::kNodeIdentity));
  EXPECT_EQ(other_device.setup_failure(),
            "boom_valve (node 0x10): reading 0x1018:02 gave 0x77, the machine file says 0x10");

  MachineDescription d = test::test_machine();
  test::node_in(d.bus, NodeRole::kTilt).tpdos[0] = 0x601;  // not a PDO's: the node refuses it
  BenchMachine refused(d);
  EXPECT_TRUE(test::is(refused.fails(), ReasonCode::kNodeSetup));
  EXPECT_EQ(refused.setup_failure(),
            "tilt (node 0x38): writing 0x1800:01 was refused: value out of range (SDO abort 0x06090030)");
  EXPECT_EQ(text(SetupFailure{}, d.bus), "");
}

TEST(NodeSetup, ARequestThatIsAnsweredOnceMoreIsNoticedAndOneThatSomebodyElseMadeIsNot) {
  using canopen::sdo_uploaded;
  const canopen::Object type = canopen::kDeviceType, vendor = canopen::kVendorId;
  const SdoScript script{{SetupPart::Kind::kIdentity, {{type, 404}}, {}},
                         {SetupPart::Kind::kIdentity, {{vendor, 7}}, {}}};
  test::KeptBus bus;
  const auto asked = [&] {
    SdoDialogue dialogue(0x22, script, 100ms);
    dialogue.receive(sdo_uploaded(0x22, type, 404, 4));  // of an earlier start
    dialogue.step(bus, Time{1s});
    return dialogue;
  };
  SdoDialogue same = asked();
  same.receive(sdo_uploaded(0x22, type, 404, 4));
  EXPECT_EQ(same.second_answers(), 0);
  same.receive(sdo_uploaded(0x22, type, 404, 4));
  EXPECT_EQ(same.second_answers(), 1);
  same.restart();
  EXPECT_EQ(same.second_answers(), 0);

  for (const std::uint32_t first : {404U, 77U}) {  // the right one may answer first or last
    SdoDialogue other = asked();
    other.receive(sdo_uploaded(0x22, type, first, 4));
    other.receive(sdo_uploaded(0x22, type, first == 404 ? 77 : 404, 4));
    EXPECT_EQ(other.second_answers(), 2) << first;
    other.receive(sdo_uploaded(0x22, type, 404, 4));
    EXPECT_EQ(other.second_answers(), 2) << first;
  }

  SdoDialogue late = asked();
  late.step(bus, Time{1s} + 100ms);  // asked again
  late.receive(sdo_uploaded(0x22, type, 404, 4));
  late.receive(sdo_uploaded(0x22, type, 404, 4));
  EXPECT_EQ(late.second_answers(), 0);

  SdoDialogue shared = asked();
  shared.others_asked();
  shared.receive(sdo_uploaded(0x22, vendor, 7, 4));
  shared.receive(sdo_uploaded(0x22, type, 404, 4));
  EXPECT_EQ(shared.second_answers(), 0);
}

TEST(NodeSetup, EmergenciesAreKeptWithTimeAndMeaning) {
  BenchMachine m;
  ASSERT_TRUE(m.starts());
  ASSERT_TRUE(m.nodes.send_emcy(0x25, 0x5030));
  m.run(10ms);
  const EmergencyLog& log = m.loop.client().emergencies();
  ASSERT_EQ(log.count(), 1U);
  EXPECT_EQ(text(log.newest(), m.description.bus),
            "bucket_rod_pressure (node 0x25): 0x5030 sensor error (error register 0x01)");
  EXPECT_LE(m.now - log.newest().at, 10ms);
  for (int i = 0; i < 100; ++i) {
    m.nodes.send_emcy(0x21, static_cast<std::uint16_t>(0xFF00 + i));
    m.tick();
  }
  m.run(10ms);
  EXPECT_EQ(log.count(), 101U);
  ASSERT_EQ(log.kept(), EmergencyLog::kKept);
  EXPECT_EQ(log.newest(0).emergency.code, 0xFF00 + 99);
  EXPECT_EQ(log.newest(31).emergency.code, 0xFF00 + 99 - 31);
}

TEST(NodeSetup, PresetMakesAnEncoderShowTheLengthAndOutlivesAReset) {
  BenchMachine m;
  ASSERT_TRUE(m.starts());
  SdoDialogue preset(0x30, preset_script(m.description, kBoom, 0.9), 250ms);
  // The loop empties the port: the answers are read off the wire.
  std::size_t seen = m.wire.size();
  for (int i = 0; i < 200 && !preset.done(); ++i) {
    preset.step(m.bus.port(0), m.now);
    m.tick();
    for (; seen < m.wire.size(); ++seen) {
      if (m.wire[seen].frame.id == 0x5B0) preset.receive(m.wire[seen].frame);
    }
  }
  ASSERT_TRUE(preset.done()) << text(preset.details(), m.description.bus);
  const auto shown = [&m] {
    m.run(20ms);
    const CanFrame frame = m.frames(0x1B0).back();
    return (frame.data[0] | frame.data[1] << 8 | frame.data[2] << 16) * m.description.sensors.encoder_step_m;
  };
  EXPECT_NEAR(shown(), 0.9, 1e-4);
  m.signals.cylinder_m[kBoom] += 0.01;
  EXPECT_NEAR(shown(), 0.91, 1.5e-4);
  m.bus.port(0).send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, 0x30));
  m.run(20ms);
  m.bus.port(0).send(canopen::nmt_frame(canopen::NmtCommand::kStart, 0x30));
  EXPECT_NEAR(shown(), 0.91, 1.5e-4);
}

// Sensors that let nobody change how they send, and send by a timer of their own.

constexpr std::uint8_t kPressureNode = 0x20, kTiltNode = 0x38;
constexpr std::uint32_t kByTimer = 254;

/// From its delivery on.
void sends_by_timer(BenchMachine& m, std::uint8_t node, std::uint32_t timer_ms, bool may_set = false,
                    std::uint32_t type = kByTimer) {
  sim::NodeProtocol& sensor = *m.nodes.node(node);
  sensor.replace(canopen::kTpdo1Type, type);
  sensor.replace(canopen::kTpdo1Timer, timer_ms);
  sensor.refuse(canopen::kTpdo1Type, canopen::SdoAbort::kReadOnly);
  if (!may_set) sensor.refuse(canopen::kTpdo1Timer, canopen::SdoAbort::kReadOnly);
}

std::string failure_of(BenchMachine& m) {
  (void)m.fails(6s);
  return m.setup_failure();
}

TEST(OwnTimer, ThatIsNoFasterThanSyncAndNoSlowerThanTheAgeLimitLetsIsRefusedInOneLineElse) {
  for (const std::uint32_t ms : {5U, 20U}) {
    BenchMachine m;
    sends_by_timer(m, kPressureNode, ms);
    ASSERT_TRUE(m.engage()) << m.setup_failure();
    m.run(2s);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << ms << ": " << text(m.loop.fault());
  }
  for (const std::uint32_t ms : {0U, 4U, 21U, 100U}) {
    BenchMachine m;
    sends_by_timer(m, kPressureNode, ms);
    EXPECT_EQ(failure_of(m),
              "boom_head_pressure (node 0x20): its transmission type 0x1800:02 cannot be changed, and its own timer "
              "0x1800:05 is " +
                  std::to_string(ms) + " ms: it must be 5 ms to 20 ms (sync_Hz, sensor_age_limit_ms)");
    EXPECT_TRUE(test::is(m.loop.client().fault(), ReasonCode::kNodeSetup));
  }
  BenchMachine none;
  sends_by_timer(none, kPressureNode, 10);
  none.nodes.node(kPressureNode)->remove(canopen::kTpdo1Timer);
  EXPECT_TRUE(test::says(failure_of(none), "its own timer 0x1800:05 cannot be read: it must be 5 ms to 20 ms"));
}

TEST(OwnTimer, ThatMayBeSetIsSetAsOftenAsSync) {
  BenchMachine m;
  sends_by_timer(m, kPressureNode, 100, true);
  sends_by_timer(m, kTiltNode, 100, true);
  ASSERT_TRUE(m.engage()) << m.setup_failure();
  EXPECT_EQ(m.nodes.node(kPressureNode)->value(canopen::kTpdo1Timer), 5U);
  EXPECT_EQ(m.nodes.node(kTiltNode)->value(canopen::kTpdo1Timer), 10U);
}

TEST(OwnTimer, DoesNotHelpASensorThatSendsWithAnotherNumberOfSyncs) {
  BenchMachine m;
  sends_by_timer(m, kPressureNode, 10, false, 3);
  EXPECT_TRUE(test::says(failure_of(m), "writing 0x1800:02 was refused"));
}

}  // namespace
}  // namespace knuckle::slave
