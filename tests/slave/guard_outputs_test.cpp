// What a module's outputs do when what its guard waits for is withheld while a cylinder moves, and how it is brought
// back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "machine/set_points.h"
#include "slave/jog.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/module_machine.h"

namespace knuckle::slave {
namespace {

using Phase = Jog::Phase;

constexpr std::uint8_t kModuleId = 0x41;

/// The bench without its loop: the jog has the bus.
struct OutputsRig {
  explicit OutputsRig(const char* outputs = test::kVoltageOutputs) : OutputsRig(test::module_machine(outputs)) {}
  explicit OutputsRig(const MachineDescription& machine)
      : bench(calibrated(machine)), jog(bench.description, bench.controllers_end) {
    bench.signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
    bench.hung = true;
  }
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
      if (jog.sample() && jog.sample()->silent) silent.push_back(*jog.sample());
    }
    EXPECT_EQ(jog.phase(), Phase::kRest);
    return way_m;
  }

  test::BenchMachine bench;
  Jog jog;
  std::vector<JogSample> silent;
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
    ASSERT_FALSE(rig.silent.empty());
    EXPECT_GT(rig.silent.back().t_s, 1.4);
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
  EXPECT_EQ(rig.jog.trouble().code, ReasonCode::kJogOtherMoves) << text(rig.jog.trouble());
  rig.step();
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
}

TEST(GuardOutputs, AModuleThatAnswersNothingIsNotLedOn) {
  OutputsRig rig;
  rig.start();
  rig.jog.try_outputs(rig.module(), {.joint = kBoom, .peak = 0.3, .rise_1ps = 0.2, .travel_m = 0.01});
  for (int i = 0; i < 2000 && rig.jog.phase() != Phase::kWithheld; ++i) rig.step();
  ASSERT_EQ(rig.jog.phase(), Phase::kWithheld);
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
  inputs.replace(inputs.find("\n8 = ") + 1, 1, "0");
  inputs.replace(inputs.find("\n1 = ") + 1, 1, "8");
  inputs.replace(inputs.find("\n0 = ") + 1, 1, "1");
  inputs.replace(inputs.find("low = -0.6"), 10, "low = 0.2");  // a broken wire reads as 0.075 rad
  OutputsRig rig(parse_machine(test::module_text(test::kVoltageOutputs, inputs), "m.toml"));
  rig.start();
  rig.jog.move({.joint = kBoom, .peak = 0.3, .travel_m = 1});
  for (int i = 0; i < 2000 && rig.jog.phase() != Phase::kMoving; ++i) rig.step();
  ASSERT_TRUE(rig.bench.nodes.inject(kModuleId, sim::NodeFault::kInvalid));
  for (int i = 0; i < 3; ++i) rig.step();
  EXPECT_EQ(rig.jog.trouble().code, ReasonCode::kSensorInvalid) << text(rig.jog.trouble());
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector::Zero());
}

}  // namespace
}  // namespace knuckle::slave
