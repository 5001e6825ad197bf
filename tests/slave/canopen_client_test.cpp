// Start-up and supervision of the machine bus against the simulated nodes, read off the wire.
#include "slave/canopen_client.h"

#include <gtest/gtest.h>

#include "tests/slave/bench_machine.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

TEST(CanopenClient, EncoderAndTiltMustCountInTheMachineFilesSteps) {
  MachineDescription fine = test::test_machine();
  fine.sensors.encoder_step_m = 3e-5;
  fine.sensors.tilt_step_rad = 0.01 * std::numbers::pi / 180;
  BenchMachine same(fine), other(fine);
  EXPECT_TRUE(same.starts()) << text(same.loop.client().fault());
  other.nodes.node(0x31)->replace(canopen::kEncoderStep, 100000);
  const Reason refused = other.fails();
  EXPECT_TRUE(test::is(refused, ReasonCode::kNodeSetup, 0x31));
}

TEST(CanopenClient, StepsThatANodeCannotBeToldAreRefused) {
  MachineDescription d = test::test_machine();
  const auto refused = [&d] { return test::refusal([&] { BenchMachine m(d); }); };
  d.sensors.encoder_step_m = 1.000001234e-4;
  EXPECT_TRUE(test::says(refused(), "sensors.encoder_step_mm"));
  d = test::test_machine();
  d.sensors.tilt_step_rad = 0.001 * std::numbers::pi / 180;  // 16 bits: 33 deg
  EXPECT_TRUE(test::says(refused(), "sensors.tilt_step_deg"));
  d.sensors.tilt_step_rad = 0.002 * std::numbers::pi / 180;
  EXPECT_EQ(refused(), "accepted");
  d.sensors.tilt_mount = SensorDescription::TiltMount::kOnBoom;
  EXPECT_TRUE(test::says(refused(), "sensors.tilt_step_deg"));
}

TEST(CanopenClient, WritesTheMachineFilesTimeoutsIntoEveryNode) {
  MachineDescription d = test::test_machine();
  d.bus.valve_watchdog_s = 0.060;
  d.bus.controller_timeout_s = 0.170;
  d.bus.node_heartbeat_s = 0.090;
  BenchMachine m(d);
  ASSERT_TRUE(m.starts());
  const auto value = [&m](int id, canopen::Object object) {
    return m.nodes.node(static_cast<std::uint8_t>(id))->value(object);
  };
  for (const int id : {0x10, 0x11, 0x12}) {
    EXPECT_EQ(value(id, canopen::kRpdo1Timer), 60U);
    EXPECT_EQ(value(id, canopen::kConsumerHeartbeat), 0x000100AAU);  // node 1, 170 ms
    EXPECT_EQ(value(id, canopen::kTpdo1Type), 4U);
    EXPECT_EQ(value(id, canopen::kRpdo1Type), 255U);
  }
  EXPECT_EQ(value(0x40, canopen::kConsumerHeartbeat), 0x000100AAU);
  for (const int id : {0x10, 0x20, 0x25, 0x30, 0x38, 0x40}) EXPECT_EQ(value(id, canopen::kProducerHeartbeat), 90U);
  for (const int id : {0x20, 0x32}) EXPECT_EQ(value(id, canopen::kTpdo1Type), 1U);
  EXPECT_EQ(value(0x38, canopen::kTpdo1Type), 2U);
}

TEST(CanopenClient, RemapsAPdoOnlyWhileItIsOff) {
  BenchMachine m;
  m.nodes.node(0x10)->replace(canopen::kTpdo1MapCount, 1);  // otherwise than wanted
  ASSERT_TRUE(m.starts());
  bool off = false, count_zero = false;
  int entries = 0;
  for (const CanFrame& f : m.frames(canopen::sdo_request_id(0x10))) {
    const auto r = canopen::parse_sdo_request(f);
    if (!r || r->kind != canopen::SdoRequest::Kind::kDownload) continue;
    if (r->object == canopen::kTpdo1CobId) off = (r->value & 0x80000000U) != 0;
    if (r->object == canopen::kTpdo1MapCount) count_zero = r->value == 0;
    EXPECT_TRUE(r->object.index != 0x1A00 || off);
    if (r->object.index == 0x1A00 && r->object.subindex > 0) {
      EXPECT_TRUE(count_zero);
      EXPECT_EQ(r->value, ++entries == 1 ? 0x60410010U : 0x63010110U);
    }
  }
  EXPECT_EQ(entries, 2);
  EXPECT_FALSE(off);
}

TEST(CanopenClient, RefusesANodeThatIsNotTheOneInTheFile) {
  for (const int id : {0x12, 0x24, 0x31, 0x38, 0x40}) {
    BenchMachine m;
    ASSERT_TRUE(m.nodes.set_product(static_cast<std::uint8_t>(id), 0x9999));
    const Reason why = m.fails();
    EXPECT_TRUE(test::is(why, ReasonCode::kNodeIdentity, id));
    EXPECT_FLOAT_EQ(why.value, 0x9999);
    m.run(20ms);
    EXPECT_EQ(m.loop.mode(), Mode::kFault);
    for (int tries = 0; tries < 2; ++tries) EXPECT_FALSE(m.engage()) << "however often the operator tries";
    EXPECT_FALSE(m.nodes.outputs().pilot);
  }
}

TEST(CanopenClient, NodeThatRebootsWhileTheBusIsSetUpMayNotJoin) {
  using Phase = CanopenClient::Phase;
  for (const Phase when : {Phase::kConfiguring, Phase::kStarting, Phase::kActivating, Phase::kOperational}) {
    BenchMachine m;
    for (int i = 0; i < 4000 && m.loop.client().phase() != when; ++i) m.tick();
    ASSERT_EQ(m.loop.client().phase(), when);
    if (when == Phase::kConfiguring) m.run(200ms);  // some of its answers are in
    ASSERT_EQ(m.loop.client().phase(), when);
    m.bus.port(1).send(canopen::heartbeat_frame(0x24, canopen::NmtState::kBootUp));
    const Reason why = m.fails(100ms);
    EXPECT_TRUE(test::is(why, ReasonCode::kNodeFault, 0x24)) << static_cast<int>(when);
  }
}

}  // namespace
}  // namespace knuckle::slave
