// How a machine is taken out of service, on a bus that loses what the test says.
#include "app/bringup/orderly_stop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "app/motion/led_machine.h"
#include "tests/bringup/hardware_bench.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using test::simulated_bus;
using test::solar;

/// The controller's end of the bus; frames with these identifiers get lost, both ways.
class LossyCan final : public CanBus {
 public:
  explicit LossyCan(CanBus& bus) noexcept : bus_(bus) {}
  bool send(const CanFrame& frame) noexcept override { return is_lost(frame) || bus_.send(frame); }
  bool receive(CanFrame& frame) noexcept override {
    while (bus_.receive(frame))
      if (!is_lost(frame)) return true;
    return false;
  }
  [[nodiscard]] CanState state() const noexcept override { return bus_.state(); }
  void acknowledge() noexcept override { bus_.acknowledge(); }
  std::vector<std::uint32_t> lost;

 private:
  [[nodiscard]] bool is_lost(const CanFrame& frame) const noexcept {
    return std::find(lost.begin(), lost.end(), frame.id) != lost.end();
  }
  CanBus& bus_;
};

/// An engaged machine, taken out of service.
struct Stopped {
  explicit Stopped(std::vector<std::uint32_t> lost = {}) {
    motion::LedMachine(solar(), access, access.now()).engage();
    engaged = bus->machine().nodes().outputs().pilot;
    bus->bus().set_tap(
        {[](void* self, Time, const CanFrame& frame) { static_cast<Stopped*>(self)->wire.push_back(frame); }, this});
    can->lost = std::move(lost);
    while (!stop.done()) {
      stop.step(access.now());
      access.wait_until(access.now() + 5ms);
    }
  }
  [[nodiscard]] std::uint32_t value(std::uint8_t node, canopen::Object object) const {
    return bus->machine().nodes().node(node)->value(object);
  }
  [[nodiscard]] auto count(std::uint32_t id) const {
    return std::count_if(wire.begin(), wire.end(), [id](const CanFrame& frame) { return frame.id == id; });
  }
  /// Every node that can move something goes on watching, in the state in which both of its watchdogs count.
  void expect_watched() const {
    EXPECT_EQ(count(canopen::kNmtId), 0);
    for (const NodeDescription& valve : solar().bus.valves) {
      EXPECT_NE(value(valve.id, canopen::kConsumerHeartbeat), 0U) << int{valve.id};
      EXPECT_NE(value(valve.id, canopen::kRpdo1Timer), 0U) << int{valve.id};
      EXPECT_TRUE(bus->machine().nodes().node(valve.id)->operational()) << int{valve.id};
    }
    const std::uint8_t enable = solar().bus.enable.id;
    EXPECT_NE(value(enable, canopen::kConsumerHeartbeat), 0U);
    EXPECT_TRUE(bus->machine().nodes().node(enable)->operational());
  }

  std::shared_ptr<sim::MachineOnBus> bus = simulated_bus();
  std::shared_ptr<LossyCan> can = std::make_shared<LossyCan>(bus->controllers_end());
  BusAccess access{"lossy bus", can, [bus = bus](Time due) { return bus->advance(due); }};
  OrderlyStop stop{solar(), access.bus()};
  bool engaged = false;
  std::vector<CanFrame> wire;
};

TEST(OrderlyStop, NodesThatAllSaidThatTheyAreOffMissNobodyAfterwards) {
  Stopped machine;
  ASSERT_TRUE(machine.engaged);
  EXPECT_EQ(machine.stop.unconfirmed_valves(), (PerJoint<bool>{}));
  EXPECT_FALSE(machine.stop.unconfirmed_pilot());
  machine.access.wait_until(machine.access.now() + 500ms);
  EXPECT_EQ(machine.count(canopen::kNmtId), 1);
  for (const NodeDescription& valve : solar().bus.valves) {
    EXPECT_EQ(machine.value(valve.id, canopen::kConsumerHeartbeat), 0U);
    EXPECT_EQ(machine.count(canopen::emcy_id(valve.id)), 0);
  }
  EXPECT_EQ(machine.value(solar().bus.enable.id, canopen::kConsumerHeartbeat), 0U);
  EXPECT_EQ(machine.count(canopen::emcy_id(solar().bus.enable.id)), 0);
  EXPECT_FALSE(machine.bus->machine().nodes().outputs().pilot);
}

TEST(OrderlyStop, AnEnableNodeThatMissedItsOutputKeepsItsWatchdogAndDropsPilotPressureByIt) {
  const NodeDescription& enable = solar().bus.enable;
  Stopped machine({enable.rpdo_id()});
  ASSERT_TRUE(machine.engaged);
  EXPECT_TRUE(machine.stop.unconfirmed_pilot());
  machine.expect_watched();
  EXPECT_TRUE(machine.bus->machine().nodes().outputs().pilot) << "nothing has told it otherwise yet";
  machine.access.wait_until(machine.access.now() + 300ms);
  EXPECT_FALSE(machine.bus->machine().nodes().outputs().pilot);
  EXPECT_GT(machine.count(canopen::emcy_id(enable.id)), 0) << "by its own watchdog";
}

TEST(OrderlyStop, AValveThatIsNotReachedKeepsItsWatchdogsAndGoesNeutralByThem) {
  const NodeDescription& boom = solar().bus.valves[kBoom];
  Stopped machine({boom.rpdo_id(), boom.tpdo_id()});
  ASSERT_TRUE(machine.engaged);
  EXPECT_TRUE(machine.stop.unconfirmed_valves()[kBoom]);
  EXPECT_FALSE(machine.stop.unconfirmed_valves()[kArm]);
  machine.expect_watched();
  machine.access.wait_until(machine.access.now() + 300ms);
  EXPECT_EQ(machine.bus->machine().nodes().outputs().spool_demand, JointVector::Zero());
  EXPECT_GT(machine.count(canopen::emcy_id(boom.id)), 0) << "by its own watchdog";
}

TEST(OrderlyStop, WhoseAnswerGotLostIsNotBelievedToBeOff) {
  const BusDescription& bus = solar().bus;
  for (const std::uint32_t lost : {bus.enable.tpdo_id(), bus.valves[kArm].tpdo_id()}) {
    Stopped machine({lost});
    ASSERT_TRUE(machine.engaged);
    EXPECT_EQ(machine.stop.unconfirmed_pilot(), lost == bus.enable.tpdo_id());
    EXPECT_EQ(machine.stop.unconfirmed_valves()[kArm], lost == bus.valves[kArm].tpdo_id());
    machine.expect_watched();
  }
}

}  // namespace
}  // namespace knuckle::bringup
