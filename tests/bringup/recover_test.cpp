// A joint that stands beyond its working range comes back into it: inward alone, nothing else, after a word each time.
#include "app/bringup/recover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <memory>
#include <sstream>

#include "machine/load.h"
#include "sim/machine_on_bus.h"
#include "tests/bringup/commission_script.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::solar;

constexpr double kRock_m = 0.004;  // oil and weight give a little

/// As if the machine stood 0.12 rad beyond an end of its boom's range.
MachineDescription narrower(bool above) {
  MachineDescription machine = solar();
  LinkDescription& boom = machine.links[kBoom];
  const double angle_rad = middle_of_range(machine)[kBoom];
  (above ? boom.max_rad : boom.min_rad) = angle_rad + (above ? -0.12 : 0.12);
  return machine;
}

struct Site {
  std::shared_ptr<sim::MachineOnBus> bus = std::make_shared<sim::MachineOnBus>(
      sim::nominal_truth(solar()), sim::WorldDescription{}, middle_of_range(solar()), 1);
  JointVector before_m = bus->plant().cylinder_m, most_m = before_m, least_m = before_m;
  bool powered = false;
  std::string told, ended;

  Site() {
    bus->each_tick = [this](sim::MachineOnBus& b) {
      powered = powered || b.machine().nodes().outputs().pilot;
      most_m = most_m.cwiseMax(b.plant().cylinder_m);
      least_m = least_m.cwiseMin(b.plant().cylinder_m);
    };
  }
  void recover_boom(const MachineDescription& machine, std::deque<std::string> script) {
    BusAccess access = sim::access_to(bus);
    std::ostringstream out;
    const auto next = test::lines_of(script);
    try {
      recover(machine, kBoom, access, terminal(out, next, false), [] {});
    } catch (const CommissionEnded& end) {
      ended = end.what();
    }
    told = out.str();
  }
};

TEST(Recover, BringsTheNamedJointInFromEitherEndAndMovesNothingElse) {
  for (const bool above : {true, false}) {
    const MachineDescription machine = narrower(above);
    Site site;
    site.recover_boom(machine, {"ready", "go", "go", "go", "go"});
    EXPECT_EQ(site.ended, "") << site.told;
    const double angle_rad = site.bus->plant().joint_rad[kBoom];
    EXPECT_GT(angle_rad, machine.links[kBoom].min_rad);
    EXPECT_LT(angle_rad, machine.links[kBoom].max_rad);
    for (const int other : {kArm, kBucket}) {
      EXPECT_LT(site.most_m[other] - site.before_m[other], kRock_m);
      EXPECT_LT(site.before_m[other] - site.least_m[other], kRock_m);
    }
    const double outward_m =
        above ? site.most_m[kBoom] - site.before_m[kBoom] : site.before_m[kBoom] - site.least_m[kBoom];
    EXPECT_LT(outward_m, kRock_m);
    EXPECT_FALSE(site.bus->machine().nodes().outputs().pilot);
    EXPECT_NE(site.told.find("Out of service: valves disabled, pilot pressure off."), std::string::npos) << site.told;
  }
}

TEST(Recover, LeavesAMachineThatAnotherControllerLeadsAlone) {
  Site site;
  const auto watch = site.bus->each_tick;
  site.bus->each_tick = [watch](sim::MachineOnBus& b) {
    watch(b);
    if (b.now().time_since_epoch() % 50ms == 0ms) b.nodes_end().shout(canopen::enable_output_frame(0x240, 0));
  };
  site.recover_boom(narrower(true), {"ready", "go", "go", "go", "go"});
  EXPECT_EQ(site.ended.find("another controller is on the bus: heard set-point 0x240"), 0U) << site.ended;
  EXPECT_FALSE(site.powered);
  EXPECT_EQ(site.bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
}

TEST(Recover, MovesNothingWhereTheJointIsWithinItsRange) {
  Site site;
  site.recover_boom(solar(), {"ready"});
  EXPECT_EQ(site.ended, "");
  EXPECT_FALSE(site.powered);
}

TEST(Recover, NothingMovesBeforeItsWordAndAWrongOneEndsIt) {
  for (const std::deque<std::string>& script :
       {std::deque<std::string>{"ready"}, {"ready", "yes"}, {"no"}, std::deque<std::string>{}}) {
    Site site;
    site.recover_boom(narrower(true), script);
    EXPECT_NE(site.ended, "");
    const bool agreed = !script.empty() && script.front() == "ready";
    EXPECT_TRUE(agreed || !site.powered);
    EXPECT_LT((site.most_m - site.least_m).maxCoeff(), kRock_m);
  }
}

TEST(Recover, APersonMayTakeTheirTime) {
  Site site;
  BusAccess access = sim::access_to(site.bus);
  std::deque<std::string> script{"ready", "go", "go", "go", "go"};
  Time asked{};
  std::ostringstream out;
  const auto next = [&]() -> std::optional<std::string> {
    if (site.bus->now() < asked + 20s) return std::nullopt;
    asked = site.bus->now();
    std::string line = script.front();
    script.pop_front();
    return line;
  };
  const MachineDescription machine = narrower(true);
  ASSERT_NO_THROW(recover(machine, kBoom, access, terminal(out, next, false), [] {})) << out.str();
  EXPECT_LT(site.bus->plant().joint_rad[kBoom], machine.links[kBoom].max_rad);
}

TEST(Recover, RefusesABusWithAnotherController) {
  Site site;
  const auto watch = site.bus->each_tick;
  site.bus->each_tick = [&](sim::MachineOnBus& b) {
    watch(b);
    if (b.now().time_since_epoch() % 100ms == 0ms)
      (void)b.nodes_end().send(canopen::heartbeat_frame(solar().bus.controller_id, canopen::NmtState::kOperational));
  };
  site.recover_boom(narrower(true), {"ready", "go", "go", "go", "go"});
  EXPECT_NE(site.ended.find("another controller is on the bus"), std::string::npos) << site.ended;
  EXPECT_EQ(site.told.find("ready"), std::string::npos) << "before anybody is asked to be ready";
  EXPECT_FALSE(site.powered);
}

TEST(Recover, AnOutwardMotionEndsItAtOnce) {
  Site site;
  const auto watch = site.bus->each_tick;
  site.bus->each_tick = [&](sim::MachineOnBus& b) {
    watch(b);
    // As if the hoses were exchanged: an open valve lets the boom be lifted.
    const bool open = std::abs(b.machine().nodes().outputs().spool_demand[kBoom]) > 0.1;
    b.machine().plant().set_pull({0, open ? 60e3 : 0});
  };
  site.recover_boom(narrower(true), {"ready", "go", "go", "go", "go"});
  EXPECT_NE(site.ended, "") << site.told;
  EXPECT_LT(site.most_m[kBoom] - site.before_m[kBoom], 0.03) << "3 mm, and what it does while the valve closes";
  EXPECT_FALSE(site.bus->machine().nodes().outputs().pilot);
}

}  // namespace
}  // namespace knuckle::bringup
