// A joint that stands beyond its working range comes back into it: inward alone, nothing else, after a word each time.
#include "app/bringup/recover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>

#include "tests/bringup/machine_kinds.h"
#include "tests/support/says.h"
#include "transport/canopen.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::Script;
using test::solar;

constexpr double kRock_m = 0.004;  // oil and weight give a little

/// As if the machine stood 0.12 rad beyond an end of its boom's range.
MachineDescription narrower(bool above, MachineDescription machine = solar()) {
  LinkDescription& boom = machine.links[kBoom];
  const double angle_rad = middle_of_range(machine)[kBoom];
  (above ? boom.max_rad : boom.min_rad) = angle_rad + (above ? -0.12 : 0.12);
  return machine;
}

struct Site {
  std::shared_ptr<sim::MachineOnBus> bus;
  JointVector before_m, most_m, least_m;
  bool powered = false;
  std::function<void(sim::MachineOnBus&)> meddle;
  std::string told, ended;

  explicit Site(const MachineDescription& truth = solar())
      : bus(std::make_shared<sim::MachineOnBus>(sim::nominal_truth(truth), sim::WorldDescription{},
                                                middle_of_range(truth), 1)) {
    before_m = most_m = least_m = bus->plant().cylinder_m;
    bus->each_tick = [this](sim::MachineOnBus& b) {
      powered = powered || b.machine().nodes().outputs().pilot;
      most_m = most_m.cwiseMax(b.plant().cylinder_m);
      least_m = least_m.cwiseMin(b.plant().cylinder_m);
      if (meddle) meddle(b);
    };
  }
  void recover_boom(const MachineDescription& machine, Script script = {"ready", "go", "go", "go", "go"}) {
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
    site.recover_boom(machine);
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
    EXPECT_TRUE(says(site.told, "Out of service: valves disabled, pilot pressure off."));
  }
}

TEST(Recover, BringsAJointInWhateverItsBusIs) {
  for (const auto& text :
       {test::two_buses_text(), test::commands_on_second(), test::j1939_text(), test::voltages_text()}) {
    const MachineDescription truth = test::machine_of(text), machine = narrower(true, truth);
    Site site(truth);
    site.recover_boom(machine);
    EXPECT_EQ(site.ended, "") << site.told;
    const double angle_rad = site.bus->plant().joint_rad[kBoom], most_rad = machine.links[kBoom].max_rad;
    EXPECT_LT(angle_rad, most_rad) << site.told;
    EXPECT_GT(angle_rad, most_rad - 0.3);
    EXPECT_TRUE(says(site.told, "Out of service: "));
    EXPECT_FALSE(says(site.told, "not confirmed"));
  }
}

TEST(Recover, LeavesAMachineThatAnotherControllerLeadsAlone) {
  const CanFrame heartbeat = canopen::heartbeat_frame(solar().bus.controller_id, canopen::NmtState::kOperational);
  for (const CanFrame& frame : {canopen::enable_output_frame(0x240, 0), heartbeat}) {
    Site site;
    site.meddle = [&frame](sim::MachineOnBus& b) {
      if (b.now().time_since_epoch() % 50ms == 0ms) b.nodes_end().shout(frame);
    };
    site.recover_boom(narrower(true));
    EXPECT_TRUE(says(site.ended, "another controller is on the bus: heard "));
    EXPECT_FALSE(says(site.told, "ready")) << "before anybody is asked to be";
    EXPECT_FALSE(site.powered);
    EXPECT_EQ(site.bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
  }
}

TEST(Recover, MovesNothingWhereTheJointIsWithinItsRange) {
  Site site;
  site.recover_boom(solar(), {"ready"});
  EXPECT_EQ(site.ended, "");
  EXPECT_FALSE(site.powered);
}

TEST(Recover, NothingMovesBeforeItsWordAndAWrongOneEndsIt) {
  for (const Script& script : {Script{"ready"}, {"ready", "yes"}, {"no"}, Script{}}) {
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
  Script script{"ready", "go", "go", "go", "go"};
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

TEST(Recover, AnOutwardMotionEndsItAtOnce) {
  Site site;
  site.meddle = [](sim::MachineOnBus& b) {
    // As if the hoses were exchanged: an open valve lets the boom be lifted.
    const bool open = std::abs(b.machine().nodes().outputs().spool_demand[kBoom]) > 0.1;
    b.machine().plant().set_pull({0, open ? 60e3 : 0});
  };
  site.recover_boom(narrower(true));
  EXPECT_NE(site.ended, "") << site.told;
  EXPECT_LT(site.most_m[kBoom] - site.before_m[kBoom], 0.03) << "3 mm, and what it does while the valve closes";
  EXPECT_FALSE(site.bus->machine().nodes().outputs().pilot);
}

}  // namespace
}  // namespace knuckle::bringup
