// The guards of what moves the machine: tried by withholding what they wait for, told where they were not proved.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "machine/set_points.h"
#include "tests/slave/jog_bench.h"
#include "tests/support/module_machine.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using Phase = Jog::Phase;
using Tried = GuardSeen::Tried;

struct GuardRig : JogBench {
  using JogBench::JogBench;
  /// To its end.
  const GuardSeen& try_guard(const NodeDescription& node) {
    jog.try_guard(node, node.joint());
    finish();
    return jog.guard_seen();
  }
  /// As far as what it waits for is withheld.
  void withhold_from(const NodeDescription& node) {
    jog.try_guard(node, kArm);
    until(Phase::kWithheld);
  }
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
  EXPECT_TRUE(test::is(rig.jog.client().fault(), ReasonCode::kSensorStale));
}

TEST(Guard, AnEStopWhileItIsTriedIsTroubleAndNeutral) {
  GuardRig rig;
  rig.start();
  const NodeDescription& valve = rig.bench.description.bus.valve(kArm);
  ASSERT_TRUE(rig.bench.nodes.inject(valve.id, sim::NodeFault::kDeadGuard));  // nothing closes it but the jog
  ASSERT_NO_FATAL_FAILURE(rig.withhold_from(valve));
  ASSERT_GT(rig.bench.nodes.outputs().spool_demand[kArm], 0.02);
  rig.bench.nodes.set_estop(true);
  for (int i = 0; i < 3; ++i) rig.step();
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kEmergencyStop));
  EXPECT_EQ(rig.jog.phase(), Phase::kRest);
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector(0, 0, 0));
}

TEST(Guard, OfAValveIsNotProvedWhereTheEnableNodeSaysNoMoreWhetherPilotPressureIsOn) {
  GuardRig rig;
  rig.start();
  const BusDescription& bus = rig.bench.description.bus;
  ASSERT_NO_FATAL_FAILURE(rig.withhold_from(bus.valve(kArm)));
  ASSERT_TRUE(rig.bench.nodes.inject(bus.enable().id, sim::NodeFault::kSilent));
  rig.finish();
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kSensorStale, bus.enable().id));
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
  MachineDescription machine = test::test_machine();
  machine.cylinders[kBoom].valve.dead_band_extend = 0;
  GuardRig rig(machine);
  rig.jog.try_guard(machine.bus.valve(kBoom), kBoom);
  EXPECT_EQ(rig.jog.phase(), Phase::kRest);
  EXPECT_EQ(rig.jog.guard_seen().tried, Tried::kNoDeadBand);
}

TEST(GuardLines, NameWhatWasNeverProvedNotProvedAndProvedOfAnotherDevice) {
  test::BenchMachine bench;
  BusDescription bus = bench.description.bus;
  const auto all_same = [](std::uint8_t) { return true; };
  std::vector<std::string> lines = guard_lines(bus, all_same);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(test::begins(
      lines[0], "never proved to stop without its controller: boom_valve, arm_valve, bucket_valve, enable; "));
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

TEST(Guard, ProvedOfAnotherSerialNumberIsToldAndTheNodeStarts) {
  for (const std::uint32_t off : {0U, 1U}) {
    constexpr std::uint32_t serial = 77;
    MachineDescription believed = test::test_machine();
    test::node_in(believed.bus, NodeRole::kValve, kArm).guard = {true, serial + off, "2026-01-02"};
    JogBench rig(test::test_machine(), believed);
    rig.bench.nodes.node(0x11)->add(canopen::kSerialNumber, 4, sim::Access::kReadOnly, serial);
    rig.begin();
    const CanopenClient& client = rig.jog.client();
    EXPECT_TRUE(client.operational()) << text(client.fault());
    EXPECT_EQ(client.same_device(0x11), off == 0);
    EXPECT_TRUE(client.same_device(0x10)) << "nothing is known of it";
  }
}

TEST(Guard, ANodeThatTakesNoneStartsOnlyWhereTheFileSaysWhy) {
  for (const char* why : {"", "a relay takes its power away"}) {
    MachineDescription believed = test::test_machine();
    test::node_in(believed.bus, NodeRole::kValve, kArm).unguarded = why;
    JogBench rig(test::test_machine(), believed);
    for (const canopen::Object guard : {canopen::kRpdo1Timer, canopen::kConsumerHeartbeat})
      rig.bench.nodes.node(0x11)->remove(guard);
    rig.begin();
    EXPECT_EQ(rig.jog.client().operational(), *why != 0);
    EXPECT_EQ(rig.jog.client().setup_failure().what == SetupFailure::What::kUnguarded, *why == 0);
  }
}

// What a module's outputs do when what its guard waits for is withheld while a cylinder moves, and how it is brought
// back.

constexpr std::uint8_t kModuleId = 0x41;

struct OutputsRig : JogBench {
  explicit OutputsRig(const char* outputs = test::kVoltageOutputs) : JogBench(test::module_machine(outputs)) {}
  explicit OutputsRig(const MachineDescription& machine) : JogBench(machine) {}
  [[nodiscard]] const NodeDescription& module() const { return *bench.description.bus.find(kModuleId); }
  [[nodiscard]] sim::NodeProtocol& protocol() { return *bench.nodes.node(kModuleId); }
  /// To its end. @return how far the cylinder went after what was withheld
  double try_outputs(int joint) {
    jog.try_outputs(module(), {.joint = joint, .peak = 0.3, .rise_1ps = 0.2, .travel_m = 0.01});
    double from_m = 0, way_m = 0;
    for (int i = 0; i < 4000 && jog.phase() != Phase::kRest; ++i) {
      step();
      if (jog.phase() == Phase::kWithheld && from_m == 0) from_m = bench.signals.cylinder_m[joint];
      if (from_m != 0) way_m = std::max(way_m, std::abs(bench.signals.cylinder_m[joint] - from_m));
    }
    EXPECT_EQ(jog.phase(), Phase::kRest);
    return way_m;
  }
};

class OutputsOf : public testing::TestWithParam<const char*> {};

TEST_P(OutputsOf, EndTheMotionWhenNoMoreFramesComeAndTheModuleIsBroughtBackNeutral) {
  for (int joint = 0; joint < kJoints; ++joint) {
    OutputsRig rig(GetParam());
    rig.start();
    const double way_m = rig.try_outputs(joint);
    EXPECT_FALSE(rig.jog.trouble()) << text(rig.jog.trouble());
    const GuardSeen& seen = rig.jog.guard_seen();
    EXPECT_FALSE(seen.by_heartbeat || seen.early || seen.silent);
    ASSERT_TRUE(seen.told_s);
    EXPECT_NEAR(*seen.told_s, 0.05, 0.02);
    EXPECT_EQ(seen.emergency, canopen::kEmcyRpdoTimeout);
    EXPECT_TRUE(seen.asked) << "pre-operational, it sends no inputs";
    EXPECT_FALSE(seen.pilot_off_s);
    EXPECT_LT(way_m, 0.02);
    const auto last_silent =
        std::find_if(rig.samples.rbegin(), rig.samples.rend(), [](const JogSample& sample) { return sample.silent; });
    ASSERT_NE(last_silent, rig.samples.rend());
    EXPECT_GT(last_silent->t_s, 1.4);
    rig.bench.wire.clear();
    rig.jog.start();
    for (int i = 0; i < 3000 && !rig.jog.client().operational(); ++i) {
      rig.bench.tick();
      ASSERT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector::Zero()) << i;
      if (i % 5 == 0) rig.jog.step(rig.bench.now);
    }
    EXPECT_TRUE(rig.jog.client().operational()) << text(rig.jog.client().fault());
    for (const auto& sent : rig.bench.wire) {
      const auto nmt = canopen::parse_nmt(sent.frame);
      EXPECT_FALSE(nmt && nmt->command == canopen::NmtCommand::kResetNode);
    }
  }
}

TEST_P(OutputsOf, ThatGoOnMovingAreSeenAndToldToStop) {
  OutputsRig rig(GetParam());
  rig.start();
  ASSERT_TRUE(rig.bench.nodes.inject(kModuleId, sim::NodeFault::kDeadGuard));
  const double way_m = rig.try_outputs(kBoom);
  EXPECT_FALSE(rig.jog.guard_seen().told_s);
  EXPECT_GT(way_m, 0.01);
  EXPECT_LT(way_m, 0.06) << "four times as far as it was led";
  for (int i = 0; i < 4; ++i) rig.step();
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector::Zero());
}

INSTANTIATE_TEST_SUITE_P(Outputs, OutputsOf, testing::Values(test::kVoltageOutputs, test::kCurrentOutputs),
                         [](const auto& kind) { return kind.index == 0 ? "HalfTheSupply" : "MagnetEachWay"; });

TEST(GuardOutputs, WithoutRpdoTimersItIsTheHeartbeatThatIsWithheldAndFramesGoOn) {
  OutputsRig rig;
  for (std::uint16_t pdo = 0x1401; pdo <= 0x1403; ++pdo) rig.protocol().remove({pdo, 5});
  rig.start();
  // As who tries it does: the enable node must not act first.
  rig.bench.nodes.node(rig.bench.description.bus.enable().id)->replace(canopen::kConsumerHeartbeat, 0);
  rig.try_outputs(kBoom);
  const GuardSeen& seen = rig.jog.guard_seen();
  EXPECT_TRUE(seen.by_heartbeat);
  ASSERT_TRUE(seen.told_s);
  EXPECT_EQ(seen.emergency, canopen::kEmcyHeartbeat);
  EXPECT_NEAR(*seen.told_s, 0.15, 0.06);
  Time before = rig.bench.wire.front().at;
  for (const auto& sent : rig.bench.wire) {
    if (!set_point_in(sent.frame, kBoom, rig.bench.description.bus)) continue;
    EXPECT_LE(sent.at - before, 20ms);
    before = sent.at;
  }
}

/// As where the file has the wrong half of 0x6444: full speed, until pilot pressure is off.
TEST(GuardOutputs, AnErrorValueThatIsNotNeutralIsEndedByPilotPressure) {
  OutputsRig rig;
  rig.start();
  rig.protocol().replace({0x6444, 1}, 0);
  const double way_m = rig.try_outputs(kBoom);
  EXPECT_GT(way_m, 0.02);
  EXPECT_LT(way_m, 0.15);
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
}

TEST(GuardOutputs, AnotherJointThatMovesEndsItAtOnce) {
  OutputsRig rig;
  rig.start();
  rig.protocol().replace({0x6444, 2}, 0);
  rig.try_outputs(kBoom);
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kJogOtherMoves));
  rig.step();
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
}

TEST(GuardOutputs, AModuleThatAnswersNothingIsNotLedOn) {
  OutputsRig rig;
  rig.start();
  rig.jog.try_outputs(rig.module(), {.joint = kBoom, .peak = 0.3, .rise_1ps = 0.2, .travel_m = 0.01});
  ASSERT_NO_FATAL_FAILURE(rig.until(Phase::kWithheld));
  rig.bench.nodes.inject(kModuleId, sim::NodeFault::kSilent);
  const Time since = rig.bench.now;
  for (int i = 0; i < 2000 && rig.jog.phase() == Phase::kWithheld; ++i) rig.step();
  EXPECT_TRUE(rig.jog.guard_seen().silent);
  EXPECT_LT(rig.bench.now - since, 300ms);
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot && rig.jog.phase() == Phase::kRest);
}

/// Of an angle, which could be one of the joint's.
TEST(GuardOutputs, ABrokenWireOfAnInputEndsAMotion) {
  std::string inputs = test::kInputs;
  for (const auto& [from, to] : {std::pair("\n8 = ", "\n0 = "), {"\n1 = ", "\n8 = "}, {"\n0 = ", "\n1 = "}})
    inputs = test::replaced(inputs, from, to);
  inputs = test::replaced(inputs, "low = -0.6", "low = 0.2");  // a broken wire reads as 0.075 rad
  OutputsRig rig(parse_machine(test::module_text(test::kVoltageOutputs, inputs), "m.toml"));
  rig.start();
  rig.jog.move({.joint = kBoom, .peak = 0.3, .travel_m = 1});
  for (int i = 0; i < 2000 && rig.jog.phase() != Phase::kMoving; ++i) rig.step();
  ASSERT_TRUE(rig.bench.nodes.inject(kModuleId, sim::NodeFault::kInvalid));
  for (int i = 0; i < 3; ++i) rig.step();
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kSensorInvalid));
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector::Zero());
}

}  // namespace
}  // namespace knuckle::slave
