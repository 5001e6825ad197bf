// Sensors that let nobody change how they send, and send by a timer of their own.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/slave/bench_machine.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

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

std::string start(BenchMachine& m) {
  for (const Time end = m.now + 6s; m.now < end && !m.loop.client().operational() && !m.loop.client().fault();)
    m.tick();
  return text(m.loop.client().setup_failure(), m.loop.client().bus());
}

TEST(OwnTimer, IsTakenAsItIsAndTheMachineRuns) {
  BenchMachine m;
  for (const std::uint8_t node : {kPressureNode, std::uint8_t{0x30}}) sends_by_timer(m, node, 10);
  sends_by_timer(m, kTiltNode, 25);
  ASSERT_TRUE(m.engage()) << start(m);
  m.wire.clear();
  m.run(2s);
  for (const std::uint32_t id : {0x1A0U, 0x1B0U}) EXPECT_EQ(m.frames(id).size(), 200U) << id;
  EXPECT_EQ(m.frames(0x1B8).size(), 80U);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
  EXPECT_NEAR(m.loop.sensors().measurement()->pressure_Pa[0], m.signals.pressure_Pa[0], 2e5);
}

TEST(OwnTimer, ThatIsNoFasterThanSyncAndNoSlowerThanTheAgeLimitLetsIsRefusedInOneLineElse) {
  for (const std::uint32_t ms : {5U, 20U}) {
    BenchMachine m;
    sends_by_timer(m, kPressureNode, ms);
    ASSERT_TRUE(m.engage()) << start(m);
    m.run(2s);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << ms << ": " << text(m.loop.fault());
  }
  for (const std::uint32_t ms : {0U, 4U, 21U, 100U}) {
    BenchMachine m;
    sends_by_timer(m, kPressureNode, ms);
    EXPECT_EQ(start(m),
              "boom_head_pressure (node 0x20): its transmission type 0x1800:02 cannot be changed, and its own timer "
              "0x1800:05 is " +
                  std::to_string(ms) + " ms: it must be 5 ms to 20 ms (sync_Hz, sensor_age_limit_ms)");
    EXPECT_EQ(m.loop.client().fault().code, ReasonCode::kNodeSetup);
  }
  BenchMachine none;
  sends_by_timer(none, kPressureNode, 10);
  none.nodes.node(kPressureNode)->remove(canopen::kTpdo1Timer);
  EXPECT_NE(start(none).find("its own timer 0x1800:05 cannot be read: it must be 5 ms to 20 ms"), std::string::npos);
}

TEST(OwnTimer, ThatMayBeSetIsSetAsOftenAsSync) {
  BenchMachine m;
  sends_by_timer(m, kPressureNode, 100, true);
  sends_by_timer(m, kTiltNode, 100, true);
  ASSERT_TRUE(m.engage()) << start(m);
  EXPECT_EQ(m.nodes.node(kPressureNode)->value(canopen::kTpdo1Timer), 5U);
  EXPECT_EQ(m.nodes.node(kTiltNode)->value(canopen::kTpdo1Timer), 10U);
}

TEST(OwnTimer, IsNotAskedForWhereTheTransmissionTypeIsAsWanted) {
  BenchMachine m;
  ASSERT_TRUE(m.engage()) << start(m);
  for (const CanFrame& answer : m.frames(canopen::sdo_response_id(kPressureNode)))
    EXPECT_NE(canopen::parse_sdo_response(answer)->object, canopen::kTpdo1Timer);
}

TEST(OwnTimer, DoesNotHelpASensorThatSendsWithAnotherNumberOfSyncs) {
  BenchMachine m;
  sends_by_timer(m, kPressureNode, 10, false, 3);
  EXPECT_NE(start(m).find("writing 0x1800:02 was refused"), std::string::npos);
}

}  // namespace
}  // namespace knuckle::slave
