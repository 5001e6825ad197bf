// What fails while a machine is commissioned is told by its name, and ends it before anything moves on.
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/bringup/commissioned.h"
#include "tests/support/says.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::commission_with;
using test::Outcome;
using test::solar;

TEST(CommissionFaults, ASensorThatIsInvalidEndsItAndIsNamed) {
  struct Case {
    const char* fault;
    const char* text;
    bool configured = true;  ///< The nodes, before that.
  };
  for (const auto& [fault, text, configured] :
       {Case{"sensor_invalid:tilt@0", "tilt: reports an impossible slope", false},
        Case{"sensor_invalid:tilt@40", "tilt (node 0x38) reports an impossible value"},
        Case{"sensor_invalid:boom_encoder@10", "boom_encoder (node 0x30) reports an impossible value"},
        Case{"sensor_invalid:boom_head_pressure@10", "boom_head_pressure (node 0x20) reports an impossible value"}}) {
    const Outcome outcome = commission_with(fault);
    EXPECT_NE(outcome.ended, "") << fault;
    EXPECT_TRUE(says(outcome.told + outcome.ended, text)) << fault;
    EXPECT_EQ(outcome.told.find("configured and started") != std::string::npos, configured) << fault << outcome.told;
    EXPECT_TRUE(outcome.left_neutral) << fault;
  }
}

TEST(CommissionFaults, ASpoolThatDoesNotFollowIsNamedAndNotThePilotPressureThatItCosts) {
  const Outcome outcome = commission_with("valve_stuck:arm_valve@0");
  EXPECT_TRUE(says(outcome.told, "arm_valve: guard not proved: its spool does not follow a small command"));
  EXPECT_TRUE(says(outcome.ended, "arm_valve (node 0x11): its spool does not follow its command"));
  EXPECT_FALSE(says(outcome.told + outcome.ended, "no pilot pressure"));
}

/// A node tells an error while the arm valve's guard is tried: the valve is open, and hears no set-points.
Outcome commission_with_error_of(std::uint8_t node) {
  constexpr Duration kWithheld = 20ms;  // set-points come more often, and its guard waits for longer
  const auto bus = test::simulated_bus();
  Time set_point_at = kNever;
  bus->bus().set_tap({[](void* newest, Time at, const CanFrame& frame) {
                        if (frame.id == solar().bus.valve(kArm).rpdo_id()) *static_cast<Time*>(newest) = at;
                      },
                      &set_point_at});
  bool told = false;
  bus->each_tick = [&](sim::MachineOnBus& b) {
    const bool open = b.machine().nodes().outputs().spool_demand[kArm] != 0;
    if (!open || b.now() - set_point_at < kWithheld || std::exchange(told, true)) return;
    EXPECT_TRUE(b.machine().send_emcy(node, 0xFF00));
  };
  const Outcome outcome = test::commission(bus, test::start());
  EXPECT_TRUE(told) << outcome.told;
  return outcome;
}

TEST(CommissionFaults, AnErrorBeforeAGuardCouldActIsNoProofAndTold) {
  const Outcome outcome = commission_with_error_of(solar().bus.valve(kArm).id);
  EXPECT_TRUE(says(outcome.told, "arm_valve: guard not proved: it told error 0xFF00 after"));
  EXPECT_TRUE(says(outcome.told, "before its guard could act (50 ms)"));
  EXPECT_FALSE(says(outcome.told, "arm_valve: guard proved"));
}

TEST(CommissionFaults, AnErrorThatANodeTellsBesideAGuardsTrialIsTold) {
  EXPECT_TRUE(says(commission_with_error_of(solar().bus.enable().id).told, "enable (node 0x40): 0xFF00"));
}

}  // namespace
}  // namespace knuckle::bringup
