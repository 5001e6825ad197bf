// The guards of what moves the machine: tried by withholding what they wait for, told where they were not proved.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "slave/jog.h"
#include "tests/slave/bench_machine.h"

namespace knuckle::slave {
namespace {

using Phase = Jog::Phase;
using Tried = GuardSeen::Tried;

/// The bench without its loop: the jog has the bus.
struct GuardRig {
  GuardRig() { bench.hung = true; }
  void step() {
    bench.run(5ms);
    jog.step(bench.now);
  }
  void start() {
    jog.start();
    for (int i = 0; i < 600; ++i) step();
    ASSERT_TRUE(jog.client().operational()) << text(jog.client().fault());
    bench.wire.clear();
  }
  /// To its end.
  const GuardSeen& try_guard(const NodeDescription& node) {
    jog.try_guard(node, node.joint());
    for (int i = 0; i < 2000 && jog.phase() != Phase::kRest; ++i) step();
    EXPECT_EQ(jog.phase(), Phase::kRest);
    return jog.guard_seen();
  }

  test::BenchMachine bench;
  Jog jog{bench.description, bench.bus.port(0)};
};

TEST(Guard, OfAValveIsTriedWithThatValveAloneInsideItsDeadBandAndOnlyItsFramesWithheld) {
  for (int joint = 0; joint < kJoints; ++joint) {
    GuardRig rig;
    rig.start();
    const BusDescription& bus = rig.bench.description.bus;
    const GuardSeen& seen = rig.try_guard(bus.valve(joint));
    EXPECT_FALSE(rig.jog.trouble()) << text(rig.jog.trouble());
    ASSERT_TRUE(seen.tried == Tried::kYes && seen.told_s && seen.stopped_s)
        << static_cast<int>(seen.tried) << ' ' << seen.told_s.value_or(-1) << ' ' << seen.stopped_s.value_or(-1) << ' '
        << seen.pilot_off_s.value_or(-1);
    EXPECT_FALSE(seen.pilot_off_s);
    EXPECT_EQ(seen.emergency, canopen::kEmcyRpdoTimeout);
    EXPECT_NEAR(*seen.told_s, bus.valve_watchdog_s, 0.02);
    EXPECT_LT(*seen.stopped_s, 0.2);
    const ValveDescription& valve = rig.bench.description.cylinders[static_cast<std::size_t>(joint)].valve;
    const double dead_band = std::min(valve.dead_band_extend, valve.dead_band_retract);
    std::vector<Time> sent[kJoints];
    for (const auto& [at, frame] : rig.bench.wire) {
      for (int i = 0; i < kJoints; ++i) {
        if (frame.id != bus.valve(i).rpdo_id()) continue;
        sent[i].push_back(at);
        const double told = canopen::parse_valve_command(frame, bus.wire.valve_full_stroke)->set_point;
        EXPECT_LE(std::abs(told), i == joint ? 0.51 * dead_band : 0) << i;
      }
    }
    for (int i = 0; i < kJoints; ++i) {
      Duration longest{};
      for (std::size_t k = 1; k < sent[i].size(); ++k) longest = std::max(longest, sent[i][k] - sent[i][k - 1]);
      EXPECT_GE(longest, i == joint ? from_seconds(*seen.stopped_s) : 0ms);
      EXPECT_LE(longest, i == joint ? 1s : 10ms) << i;
    }
  }
}

TEST(Guard, ThatIsDeadIsSeenAndTheValveIsToldToCloseAtOnce) {
  GuardRig rig;
  rig.start();
  const NodeDescription& valve = rig.bench.description.bus.valve(kBoom);
  ASSERT_TRUE(rig.bench.nodes.inject(valve.id, sim::NodeFault::kDeadGuard));
  const GuardSeen& seen = rig.try_guard(valve);
  EXPECT_EQ(seen.tried, Tried::kYes);
  EXPECT_FALSE(seen.told_s || seen.stopped_s || seen.pilot_off_s);
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector(0, 0, 0));
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
  EXPECT_FALSE(rig.jog.trouble());
}

TEST(Guard, OfTheEnableNodeTakesPilotPressureAwayWithoutAHeartbeat) {
  for (const bool dead : {false, true}) {
    GuardRig rig;
    rig.start();
    const BusDescription& bus = rig.bench.description.bus;
    ASSERT_TRUE(rig.bench.nodes.inject(bus.enable().id, dead ? sim::NodeFault::kDeadGuard : sim::NodeFault::kNone));
    const GuardSeen& seen = rig.try_guard(bus.enable());
    EXPECT_FALSE(rig.jog.trouble()) << text(rig.jog.trouble());
    EXPECT_EQ(seen.stopped_s.has_value(), !dead);
    EXPECT_NEAR(seen.stopped_s.value_or(bus.controller_timeout_s), bus.controller_timeout_s,
                bus.controller_heartbeat_s + 0.01);
    EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
    rig.start();  // and all of it works again
  }
}

TEST(Guard, OfANodeThatGoesPreOperationalIsAskedBySdo) {
  GuardRig rig;
  const BusDescription& bus = rig.bench.description.bus;
  for (const NodeDescription& node : bus.nodes)
    if (node.is_told()) rig.bench.nodes.node(node.id)->add(canopen::kErrorBehaviour, 1, sim::Access::kReadWrite);
  for (const NodeDescription& node : bus.nodes) {
    if (!node.is_told()) continue;
    rig.start();
    const GuardSeen& seen = rig.try_guard(node);
    EXPECT_FALSE(rig.jog.trouble()) << node.name << ": " << text(rig.jog.trouble());
    EXPECT_TRUE(seen.told_s && seen.stopped_s && seen.asked && !seen.silent && !seen.pilot_off_s) << node.name;
    EXPECT_LT(seen.stopped_s.value_or(1), 0.35) << node.name;
  }
}

TEST(Guard, WhatANodeAnswersToOthersIsNoProcessData) {
  GuardRig rig;
  rig.start();
  const NodeDescription& valve = rig.bench.description.bus.valve(kArm);
  rig.bench.nodes.inject(valve.id, sim::NodeFault::kSilent);
  for (int i = 0; i < 40; ++i) {
    rig.bench.bus.port(2).send(canopen::sdo_uploaded(valve.id, canopen::kValveActual, 0, 2));
    rig.step();
  }
  EXPECT_FALSE(rig.jog.client().operational());
  EXPECT_EQ(rig.jog.client().fault().code, ReasonCode::kSensorStale) << text(rig.jog.client().fault());
}

TEST(Guard, AnEStopWhileItIsTriedIsTroubleAndNeutral) {
  GuardRig rig;
  rig.start();
  const NodeDescription& valve = rig.bench.description.bus.valve(kArm);
  ASSERT_TRUE(rig.bench.nodes.inject(valve.id, sim::NodeFault::kDeadGuard));  // nothing closes it but the jog
  rig.jog.try_guard(valve, kArm);
  for (int i = 0; i < 400 && rig.jog.phase() != Phase::kWithheld; ++i) rig.step();
  ASSERT_EQ(rig.jog.phase(), Phase::kWithheld);
  ASSERT_GT(rig.bench.nodes.outputs().spool_demand[kArm], 0.02);
  rig.bench.nodes.set_estop(true);
  for (int i = 0; i < 3; ++i) rig.step();
  EXPECT_EQ(rig.jog.trouble().code, ReasonCode::kEmergencyStop);
  EXPECT_EQ(rig.jog.phase(), Phase::kRest);
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector(0, 0, 0));
}

TEST(Guard, OfAValveIsNotProvedWhereTheEnableNodeSaysNoMoreWhetherPilotPressureIsOn) {
  GuardRig rig;
  rig.start();
  const BusDescription& bus = rig.bench.description.bus;
  rig.jog.try_guard(bus.valve(kArm), kArm);
  for (int i = 0; i < 400 && rig.jog.phase() != Phase::kWithheld; ++i) rig.step();
  ASSERT_EQ(rig.jog.phase(), Phase::kWithheld);
  ASSERT_TRUE(rig.bench.nodes.inject(bus.enable().id, sim::NodeFault::kSilent));
  for (int i = 0; i < 400 && rig.jog.phase() != Phase::kRest; ++i) rig.step();
  EXPECT_EQ(rig.jog.trouble().code, ReasonCode::kSensorStale) << text(rig.jog.trouble());
  EXPECT_EQ(rig.jog.trouble().subject, bus.enable().id);
}

/// Moves the cylinder that is tried, as where the file's dead band is not the valve's.
TEST(Guard, ACylinderThatMovesAtTheSmallOpeningEndsItAtOnce) {
  GuardRig rig;
  rig.start();
  rig.jog.try_guard(rig.bench.description.bus.valve(kArm), kArm);
  int crept = 0;
  for (int i = 0; i < 400 && rig.jog.phase() != Phase::kRest; ++i) {
    if (rig.bench.nodes.outputs().spool_demand[kArm] > 0.01) rig.bench.signals.cylinder_m[kArm] += 1e-4;
    crept += rig.jog.guard_seen().crept_m ? 1 : 0;
    EXPECT_TRUE(crept < 3 || rig.bench.nodes.outputs().spool_demand[kArm] == 0) << "two steps after";
    rig.step();
  }
  ASSERT_TRUE(rig.jog.guard_seen().crept_m);
  EXPECT_LT(*rig.jog.guard_seen().crept_m, 3e-3);
}

TEST(Guard, WithoutADeadBandToOpenTheValveInItIsNotTriedAndNothingMoves) {
  GuardRig rig;
  MachineDescription machine = rig.bench.description;
  machine.cylinders[kBoom].valve.dead_band_extend = 0;
  Jog jog(machine, rig.bench.bus.port(0));
  jog.try_guard(machine.bus.valve(kBoom), kBoom);
  EXPECT_EQ(jog.phase(), Phase::kRest);
  EXPECT_EQ(jog.guard_seen().tried, Tried::kNoDeadBand);
}

TEST(GuardLines, NameWhatWasNeverProvedNotProvedAndProvedOfAnotherDevice) {
  test::BenchMachine bench;
  BusDescription bus = bench.description.bus;
  const auto all_same = [](std::uint8_t) { return true; };
  std::vector<std::string> lines = guard_lines(bus, all_same);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0],
            "never proved to stop without its controller: boom_valve, arm_valve, bucket_valve, enable; knuckle "
            "commission proves it");
  const auto node = [&bus](const std::string& name) -> NodeDescription& {
    return *std::find_if(bus.nodes.begin(), bus.nodes.end(), [&](const auto& n) { return n.name == name; });
  };
  node("boom_valve").guard = {true, 7, "2026-01-02"};
  node("arm_valve").guard = {false, 8, "2026-01-02"};
  node("bucket_valve").unguarded = "a relay takes its power away";
  using Changed = GuardProof::Changed;
  node("enable").guard = {true, 9, "2026-01-02", Changed::kTimes};
  lines = guard_lines(bus, [](std::uint8_t id) { return id != 0x10; });
  EXPECT_EQ(lines, (std::vector<std::string>{
                       "the guard of boom_valve was proved on 2026-01-02, of another device",
                       "the guard of arm_valve was tried on 2026-01-02 and not proved",
                       "bucket_valve may have no guard, as the machine file says: a relay takes its power away",
                       "the guard of enable was proved on 2026-01-02, with other times than the machine file now has "
                       "(valve_watchdog_ms, controller_timeout_ms)"}));
}

/// Starts the nodes of the machine as its file is, with a change.
void start_with(const std::function<void(MachineDescription&, sim::CanNodes&)>& change,
                const std::function<void(const CanopenClient&)>& check) {
  test::BenchMachine bench;
  bench.hung = true;
  MachineDescription machine = bench.description;
  change(machine, bench.nodes);
  Jog jog(machine, bench.bus.port(0));
  jog.start();
  for (int i = 0; i < 600; ++i) {
    bench.run(5ms);
    jog.step(bench.now);
  }
  check(jog.client());
}

TEST(Guard, ProvedOfAnotherSerialNumberIsToldAndTheNodeStarts) {
  for (const std::uint32_t off : {0U, 1U}) {
    start_with(
        [&](MachineDescription& machine, sim::CanNodes& nodes) {
          constexpr std::uint32_t serial = 77;
          nodes.node(machine.bus.valve(kArm).id)->add(canopen::kSerialNumber, 4, sim::Access::kReadOnly, serial);
          for (NodeDescription& node : machine.bus.nodes)
            if (node.name == "arm_valve") node.guard = {true, serial + off, "2026-01-02"};
        },
        [&](const CanopenClient& client) {
          EXPECT_TRUE(client.operational()) << text(client.fault());
          EXPECT_EQ(client.same_device(0x11), off == 0);
          EXPECT_TRUE(client.same_device(0x10)) << "nothing is known of it";
        });
  }
}

TEST(Guard, ANodeThatTakesNoneStartsOnlyWhereTheFileSaysWhy) {
  for (const bool says_why : {false, true}) {
    start_with(
        [&](MachineDescription& machine, sim::CanNodes& nodes) {
          sim::NodeProtocol* valve = nodes.node(machine.bus.valve(kArm).id);
          valve->remove(canopen::kRpdo1Timer);
          valve->remove(canopen::kConsumerHeartbeat);
          for (NodeDescription& node : machine.bus.nodes)
            if (says_why && node.name == "arm_valve") node.unguarded = "a relay takes its power away";
        },
        [&](const CanopenClient& client) {
          EXPECT_EQ(client.operational(), says_why);
          const auto unguarded = SetupFailure::What::kUnguarded;
          EXPECT_EQ(client.setup_failure().what == unguarded, !says_why);
        });
  }
}

}  // namespace
}  // namespace knuckle::slave
